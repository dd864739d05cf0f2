"""Where a twin is in a new view: its 6D pose from depth, refused where the twin does not explain what is seen."""
