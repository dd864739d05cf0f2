"""A finished twin: its record (twin.json), its folder and its grasp table."""
