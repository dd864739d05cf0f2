"""Deviation of a functional frame from its feature, for validation."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.geometry.distance import distance_to_surface
from manitwin.geometry.frames.feature import Kind

ON_FEATURE_M = 0.005
"""Tolerance: the origin of a frame is this close to the surface; for an opening or hole, its plane to the walls."""
_SECTORS, _LEAST_SECTORS = 8, 5  # around an opening or hole, and the number of them that must contain walls
_NEAR, _FAR = 0.5, 3.0  # times the radius: range of distances of the walls of an opening or hole, including oblong ones
_INSIDE_SHARE = 0.25  # fraction of an axis' length: a part that is thicker is not slender enough to have one


def feature_deviation_m(
    kind: Kind,
    position_m: np.ndarray,
    rotation: np.ndarray,
    size_m: float,
    surface_m: np.ndarray,
    mesh: trimesh.Trimesh | None = None,
) -> float:
    """Return the distance (m) of a frame from its feature, from surface samples ``(N, 3)``; inf if no part of it is found.

    For an opening or hole, it is the distance of its plane from the walls in at least five of eight sectors. For an axis, which
    lies inside, it is the excess over a quarter of its length. For other kinds, it is the distance of the origin from the
    surface. Samples on a large object are some millimetres apart; with ``mesh``, distances above the tolerance are computed
    exactly.
    """
    offset = surface_m - position_m
    if kind not in ("opening", "hole"):
        nearest = float(np.linalg.norm(offset, axis=1).min())
        if mesh is not None and nearest > ON_FEATURE_M:
            nearest = float(distance_to_surface(position_m[None], mesh)[0])
        return max(0.0, nearest - _INSIDE_SHARE * size_m) if kind == "axis" else nearest
    local = offset @ rotation
    radial = np.hypot(local[:, 0], local[:, 1])
    around = (radial > _NEAR * size_m) & (radial < _FAR * size_m)
    sector = ((np.arctan2(local[:, 1], local[:, 0]) + np.pi) / (2 * np.pi) * _SECTORS).astype(int) % _SECTORS
    nearest_m = [
        float(np.abs(local[around & (sector == s), 2]).min()) if (around & (sector == s)).any() else np.inf
        for s in range(_SECTORS)
    ]
    return float(np.sort(nearest_m)[_LEAST_SECTORS - 1])
