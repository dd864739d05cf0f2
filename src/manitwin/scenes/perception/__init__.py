"""Perception data from scenes: exact ground truth of each picture, and data sets in common formats."""
