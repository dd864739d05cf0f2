"""Statistics of a data set: SQL tables over its index, figures, and an HTML report."""
