"""Embedders: what a picture or a text is, as numbers that lie near those of what is alike."""
