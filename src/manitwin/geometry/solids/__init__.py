"""Closed solids by construction: shapes, sweeps and unions of named parts."""
