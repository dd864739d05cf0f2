"""Fit templates to photos: measures and camera views by least squares on silhouettes, and textures from the photos."""
