"""Readers of asset formats, one module with a ``read`` function for each."""
