"""Publication of an episodes folder as a data set repository."""
