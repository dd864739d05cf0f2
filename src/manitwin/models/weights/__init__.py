"""Trained weights that are fetched on request only: catalogue, sources and licences."""
