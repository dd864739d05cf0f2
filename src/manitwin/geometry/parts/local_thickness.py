"""How thick a body is behind points of its surface."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.geometry.ray_caster import RayCaster

_START_BELOW_SURFACE_M = 1e-5  # the ray must not meet the face that it starts on


def local_thickness(mesh: trimesh.Trimesh, points_m: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the length (m) of matter behind surface points ``(N, 3)``, straight against outward normals ``(N, 3)``.

    A ray goes inward to the first surface. Where it meets none (a grazing point of an imperfect mesh), the answer is 0.
    """
    inward = -normals / np.linalg.norm(normals, axis=1, keepdims=True)
    distance, _ = RayCaster(mesh).first_hits(points_m + inward * _START_BELOW_SURFACE_M, inward)
    return np.where(np.isfinite(distance), distance + _START_BELOW_SURFACE_M, 0.0)
