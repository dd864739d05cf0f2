"""Functional frames from geometry: where the feature that a point means truly is. What is not clear is no frame but a reason."""
