"""Statistics of an episodes folder: attempts planned, executed, succeeded and kept, and their failures."""
