"""Embedding models: pictures, texts and point clouds as vectors, with similar inputs close together."""
