"""Twins against truth that somebody else wrote down: labels of annotations, scored with intervals."""
