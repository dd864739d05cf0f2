"""Convex hull of a mesh file with only points, for formats and engines that interpret it so."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import QhullError

from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import make_part, pbr_material

_FLAT = 1e-9
"""Ratio of the smallest to the largest singular value up to which points count as coplanar."""


def hull_part(points: np.ndarray, source: MeshSource, color: tuple[float, float, float]) -> trimesh.Trimesh:
    """Return the convex hull of points ``(N, 3)`` as a part in one colour, with a finding.

    Raises InputError ``no_faces`` if they span no volume. Source: MuJoCo's XML reference, ``mesh``.
    """
    points = np.asarray(points, float)
    flat = source.refused(
        "no_faces",
        f"{len(points)} vertices, no faces, and no volume between them",
        "export the surface, not a point cloud",
    )
    if len(points) < 4 or not np.isfinite(points).all():
        raise flat
    spans = np.linalg.svd(points - points.mean(0), compute_uv=False)
    if spans[2] <= _FLAT * spans[0]:
        raise flat
    try:
        hull = trimesh.convex.convex_hull(points)
    except QhullError as error:
        raise flat from error
    source.add_finding(f"it holds {len(points)} points and no faces: their convex hull was read")
    return make_part(hull.vertices, hull.faces, material=pbr_material(None, base_color=color), name="mesh")
