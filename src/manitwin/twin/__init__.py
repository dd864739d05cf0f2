"""A finished twin: its record, its folder, its table of grasps."""
