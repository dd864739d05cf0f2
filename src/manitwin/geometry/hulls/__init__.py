"""Convex decomposition of solids for collision, reduction of the hulls, and measurement of the error."""
