"""Poses, sampling, mass properties, repair, convex hulls, distances: pure functions over arrays."""
