"""Is this asset true? Rules that any asset can be held against, with no GPU and no model."""
