"""A twin in the files of other tools: one truth, written out in each of them."""
