"""Geometry on arrays and meshes: poses, sampling, mass properties, repair, convex hulls, distances. All functions are pure."""
