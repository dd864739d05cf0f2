"""Convex footprints: what an object covers of the plane it stands on."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull


def footprint(points_m: np.ndarray) -> np.ndarray:
    """Return the corners ``(K, 2)``, counter-clockwise, of the convex hull of points ``(N, 3)`` projected along Z."""
    flat = points_m[:, :2]
    return flat[ConvexHull(flat).vertices]


def separation_m(first: np.ndarray, second: np.ndarray) -> float:
    """Return a lower bound of the distance of two convex polygons ``(K, 2)``, negative where they overlap.

    The largest gap along the normals of their edges (separating axes): the distance itself, but where the nearest points are
    two corners; then it is less.
    """
    gaps = []
    for one, other in ((first, second), (second, first)):
        edges = np.roll(one, -1, axis=0) - one
        normals = np.stack([edges[:, 1], -edges[:, 0]], 1)
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        gaps.append(((other @ normals.T).min(0) - (one * normals).sum(1)).max())
    return float(max(gaps))
