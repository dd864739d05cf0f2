"""Places of a surface around a point of it, closer to each other than candidates are."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.frames.feature import FramedMesh

REACH_SHARE = 0.15  # of the longest side: how far from the point
_SAME_PLACE_M = 0.01  # nearer than that a place may look another way: an edge is of both its sides


def around(surface: FramedMesh, at_m: np.ndarray, outward: np.ndarray) -> np.ndarray:
    """Return the indices of the surface's samples within reach of a point ``(3,)``, on its side of the matter."""
    positions, normals = surface.samples
    near = surface.near(at_m, REACH_SHARE * surface.size_m)
    return near[(normals[near] @ outward > 0) | (np.linalg.norm(positions[near] - at_m, axis=1) < _SAME_PLACE_M)]
