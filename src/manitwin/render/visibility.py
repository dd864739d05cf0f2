"""Visibility of a mesh's faces from outside, per side; invisible faces need not be rendered."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.repair.halfedges import is_closed_and_consistent, label_components
from manitwin.geometry.repair.thickening import fibonacci_sphere
from manitwin.geometry.repair.welding import weld_equal

DIRECTIONS = 128
SPACING_M = 0.008
_FEWEST, _MOST = 1, 24  # subdivisions of a triangle's longest side
_INWARD = 0.02  # fraction of the way to the triangle's centre, so that no point is on its border
_OFF_SURFACE_M = 2e-5  # offset of the ray origins
_GRAZING = 0.02  # cosine to the normal, below which a ray would graze its own face


def is_closed_and_outward(mesh: trimesh.Trimesh) -> bool:
    """Return whether a mesh with welded seams is closed and all its components face outward, so that no back face is visible."""
    vertices, faces = weld_equal(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    if not is_closed_and_consistent(faces, len(vertices)):
        return False
    links = np.concatenate([faces[:, :2], faces[:, 1:]])
    piece = label_components(len(vertices), links[:, 0], links[:, 1])[faces[:, 0]]
    a, b, c = np.swapaxes((vertices - vertices.mean(0))[faces], 0, 1)
    volumes = np.bincount(piece, np.einsum("fi,fi->f", a, np.cross(b, c)))
    return bool((volumes[np.unique(piece)] > 0).all())  # unused vertices are components of their own


def externally_visible_faces(mesh: trimesh.Trimesh, *, from_behind: bool = False) -> np.ndarray:
    """Return for each face ``(F,) bool`` whether its outward side, or its back, is visible from outside.

    Rays are cast in 128 directions, 14 degrees apart, from points 8 mm apart on each side (or a 24th of its length if longer
    than 19 cm); a side is visible if a ray escapes. Surfaces seen only through narrower gaps, such as the bottom of a deep
    hole, count as invisible.
    """
    caster, side = RayCaster(mesh), -1.0 if from_behind else 1.0
    normals = side * caster.face_normals
    places, of_face = _places(np.asarray(mesh.triangles))
    seen = np.zeros(len(normals), bool)
    for direction in fibonacci_sphere(DIRECTIONS):
        asked = np.flatnonzero((~seen & (normals @ direction > _GRAZING))[of_face])
        origins = places[asked] + _OFF_SURFACE_M * normals[of_face[asked]]
        _, met = caster.first_hits(origins, np.broadcast_to(direction, origins.shape))
        seen[of_face[asked[met < 0]]] = True
    return seen


def _places(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return grid points ``(P, 3)`` on triangles ``(F, 3, 3)``, including near their corners, and the triangle of each."""
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(1)
    parts = np.clip(np.ceil(longest / SPACING_M), _FEWEST, _MOST).astype(int)
    points, of_face = [], []
    for count in np.unique(parts):
        first, second = np.nonzero(np.add.outer(np.arange(count + 1), np.arange(count + 1)) <= count)
        weights = np.column_stack([first, second, count - first - second]) / count
        weights = (1 - _INWARD) * weights + _INWARD / 3
        these = np.flatnonzero(parts == count)
        points.append(np.einsum("pc,fcx->fpx", weights, triangles[these]).reshape(-1, 3))
        of_face.append(np.repeat(these, len(weights)))
    return np.concatenate(points), np.concatenate(of_face)
