"""Fit templates to photos: see ``fit``."""
