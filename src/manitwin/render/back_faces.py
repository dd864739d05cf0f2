"""Whether a thing's faces must be drawn from behind too."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
import trimesh

from manitwin.geometry.poses import rotation_between
from manitwin.geometry.ray_caster import RayCaster
from manitwin.render.raycast import merged

_RAYS = 40  # each way, from each side
_SEEN_FROM_BEHIND = 2e-4  # share of the hits: what grazing rays find between two triangles of a closed solid is less


def shows_back_faces(parts: Sequence[trimesh.Trimesh]) -> bool:
    """Tell whether faces of the parts, as one thing, are seen from behind from outside: open sheets, or a wrong winding.

    Asked of parallel rays from the 26 directions of a cube's faces, edges and corners. Drawing both sides costs twice the
    time.
    """
    mesh = merged(list(parts))
    if not len(mesh.faces):
        return False
    caster = RayCaster(mesh)
    center, radius = mesh.bounds.mean(0), float(np.linalg.norm(np.ptp(mesh.bounds, axis=0))) / 2
    side = (np.arange(_RAYS) + 0.5) / _RAYS * 2 - 1
    plane = np.stack([*np.meshgrid(side, side), np.ones((_RAYS, _RAYS))], -1).reshape(-1, 3) * radius
    hits = behind = 0
    for direction in product((-1, 0, 1), repeat=3):
        if direction == (0, 0, 0):
            continue
        toward = np.array(direction) / np.linalg.norm(direction)
        origins = center + plane @ rotation_between(np.array([0.0, 0, 1]), toward).T
        _, face = caster.first_hits(origins, np.broadcast_to(-toward, origins.shape))
        normals = caster.face_normals[face[face >= 0]]
        hits += len(normals)
        behind += int((normals @ toward < -1e-3).sum())
    return behind > _SEEN_FROM_BEHIND * hits
