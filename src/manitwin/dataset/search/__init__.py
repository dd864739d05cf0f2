"""Search of a data set by words and by picture, with embeddings stored beside its index."""
