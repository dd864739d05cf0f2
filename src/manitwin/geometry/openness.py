"""Ambient accessibility: how much of the surroundings each surface point sees."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.repair.thickening import fibonacci_sphere

DIRECTIONS = 24
_OFF_SURFACE = 1e-4  # fraction of the body's size: offset of the ray origins


def unoccluded_share(mesh: trimesh.Trimesh, points_m: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the unoccluded share ``(N,)`` of the surroundings before each surface point ``(N, 3)``.

    It is 1 on a convex body and 0 in a closed cavity: the accessibility of ambient light, weighted by the cosine to the outward
    normals ``(N, 3)`` (Zhukov, Iones, Kronin 1998, "An ambient light illumination model", eq. 3), over evenly spread
    directions.
    """
    caster = RayCaster(mesh)
    start = points_m + _OFF_SURFACE * float(mesh.scale) * normals
    free, whole = np.zeros(len(points_m)), np.zeros(len(points_m))
    for direction in fibonacci_sphere(DIRECTIONS):
        cosine = normals @ direction
        ahead = np.flatnonzero(cosine > 0)
        distance, _ = caster.first_hits(start[ahead], np.broadcast_to(direction, (len(ahead), 3)))
        free[ahead] += cosine[ahead] * np.isinf(distance)
        whole[ahead] += cosine[ahead]
    return free / np.maximum(whole, 1e-12)
