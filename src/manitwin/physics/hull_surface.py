"""The surface of convex hulls as one mesh, for rays."""

from __future__ import annotations

import numpy as np
import trimesh


def union_surface(hulls: tuple[np.ndarray, ...]) -> trimesh.Trimesh:
    """Return the faces of all hulls (each ``(V, 3)`` m) as one mesh; those inside other hulls are in it too."""
    surfaces = [trimesh.convex.convex_hull(vertices) for vertices in hulls]
    offsets = np.cumsum([0] + [len(surface.vertices) for surface in surfaces[:-1]])
    faces = [surface.faces + offset for surface, offset in zip(surfaces, offsets, strict=True)]
    vertices = np.concatenate([surface.vertices for surface in surfaces])
    return trimesh.Trimesh(vertices, np.concatenate(faces), process=False)
