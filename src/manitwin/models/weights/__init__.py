"""Weights that others trained, fetched on request only: what is known, where it lies, under which licence."""
