"""Where an object is held, used, and which part each of its points is of: maps on its surface, as data sets."""
