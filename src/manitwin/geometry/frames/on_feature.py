"""How far a frame is from the feature that it says it is of."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.geometry.distance import distance_to_surface
from manitwin.geometry.frames.feature import Kind

ON_FEATURE_M = 0.005
"""The origin of a frame lies this near to the surface, that of an opening or hole to the plane of its walls."""
_SECTORS, _LEAST_SECTORS = 8, 5  # around an opening or hole, and in how many of them there must be walls
_NEAR, _FAR = 0.5, 3.0  # times the radius: where the walls of an opening or hole are, oblong ones too
_INSIDE_SHARE = 0.25  # of an axis' length: what is thicker is not slender enough to have one


def off_feature_m(
    kind: Kind,
    position_m: np.ndarray,
    rotation: np.ndarray,
    size_m: float,
    surface_m: np.ndarray,
    mesh: trimesh.Trimesh | None = None,
) -> float:
    """Return how far (m) a frame is from its feature, by samples of the surface ``(N, 3)``; inf: nothing of it is there.

    Of an opening and a hole this is the distance of its plane from the walls around it in five of eight sectors at least; of
    an axis, which runs inside, what is more than a quarter of its length; of the others that of the origin. Samples are some
    millimetres apart on a large thing: with its ``mesh`` what they call too far is measured exactly.
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
