"""Search a data set by words and by a picture, over embeddings that are kept beside its index."""
