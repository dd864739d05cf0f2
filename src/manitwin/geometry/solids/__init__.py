"""Constructive solid geometry: primitive shapes, sweeps, and unions of named parts."""
