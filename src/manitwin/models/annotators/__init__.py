"""Annotators: category, physical properties and use of an object.

The paper asks a VLM; the built-in ``rules`` use a table of priors and the geometry.
"""
