"""Surface samples near a candidate point, denser than the candidates themselves."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.frames.feature import FramedMesh

REACH_SHARE = 0.15  # fraction of the longest side: search radius
_SAME_PLACE_M = 0.01  # within this distance a sample may face another way, as an edge belongs to both of its sides


def find_nearby_samples(surface: FramedMesh, at_m: np.ndarray, outward: np.ndarray) -> np.ndarray:
    """Return the indices of the surface samples within reach of a point ``(3,)`` that face the same side."""
    positions, normals = surface.samples
    near = surface.near(at_m, REACH_SHARE * surface.size_m)
    return near[(normals[near] @ outward > 0) | (np.linalg.norm(positions[near] - at_m, axis=1) < _SAME_PLACE_M)]
