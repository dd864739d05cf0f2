"""Functional frames from geometry: the frame of the feature at a functional point, or the reason why it is ambiguous."""
