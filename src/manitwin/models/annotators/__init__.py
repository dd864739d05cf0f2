"""Annotators: category, mass and use of an object. A VLM's work in the paper; the built-in ``rules`` read priors and shape."""
