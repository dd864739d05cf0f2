"""Telling the mouth of a cup from a hole in a solid."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.repair.surface import Surface, face_cross_products
from manitwin.geometry.sampling import sample_surface

_SAMPLES = 32  # points on a closing surface
_DIRECTIONS = 128  # rays from each
_FOLD_COSINE = (
    0.7  # a lid is folded off the wall around it by 45 degrees or more on average; a patch carries its surface on
)
_BAND = 0.25  # of a patch's size: how wide a band of the surface around it is looked at
_OPENNESS = 0.5  # of the half space before a lid; a patch deep in a crevice sees less of the outside


def lids(
    closed: Surface, loop_of_face: np.ndarray, rim_lengths: np.ndarray, lid_length_m: float, lid_area_share: float
) -> np.ndarray:
    """Return the loops whose patch would put a lid on an open sheet, ascending.

    A lid has a rim longer than ``lid_length_m``, more than ``lid_area_share`` of its component's remaining area, folds
    away from the faces around it, and sees the outside from most of its face. Patches where scans did not see into a
    crevice see little of the outside; large faces missing from a coarse mesh lie in the plane of others or have a rim
    of three edges. ``loop_of_face (F,)`` is -1 for faces that belong to no patch.
    """
    patch = loop_of_face >= 0
    areas, labels = closed.areas, closed.components()
    kept_area = np.bincount(labels, areas * ~patch, minlength=int(labels.max()) + 1)
    found = []
    mesh = trimesh.Trimesh(closed.vertices, closed.faces, process=False)
    caster = RayCaster(mesh)
    for loop in np.flatnonzero(rim_lengths > lid_length_m):
        faces = np.flatnonzero(loop_of_face == loop)
        one_missing_face = len(faces) == 1 and (labels == labels[faces[0]]).sum() > 2
        if (
            len(faces)
            and not one_missing_face
            and areas[faces].sum() > lid_area_share * kept_area[labels[faces[0]]]
            and _band_cosine(closed, loop_of_face == loop, areas[faces].sum()) < _FOLD_COSINE
            and _openness(mesh, caster, faces) > _OPENNESS
        ):
            found.append(loop)
    return np.array(found, dtype=np.int64)


def _band_cosine(closed: Surface, is_patch: np.ndarray, patch_area: float) -> float:
    """Return the mean cosine between the normal of a patch and those of the surface around it, weighted by area.

    The surface around is what lies within a quarter of the patch's size of its rim, walked from face to face: so the
    rounded lip of a cup counts less than the wall below, and the other side of a thin plate not at all.
    """
    glued = np.flatnonzero((closed.twin >= 0) & ~np.repeat(is_patch, 3))
    to_patch = is_patch[closed.twin[glued] // 3]
    at_rim = np.unique(glued[to_patch] // 3)
    a, b = glued[~to_patch] // 3, closed.twin[glued[~to_patch]] // 3
    centers = closed.vertices[closed.faces].mean(1)
    step = np.maximum(np.linalg.norm(centers[a] - centers[b], axis=1), np.finfo(float).tiny)
    graph = csr_matrix((step, (a, b)), shape=(len(centers), len(centers)))
    walked = dijkstra(graph, indices=at_rim, min_only=True, limit=_BAND * np.sqrt(patch_area))
    band = np.flatnonzero(np.isfinite(walked))
    cross = face_cross_products(closed.vertices, closed.faces)
    normal = cross[is_patch].sum(0)
    normal /= max(float(np.linalg.norm(normal)), np.finfo(float).tiny)
    return float((cross[band] @ normal).sum() / max(np.linalg.norm(cross[band], axis=1).sum(), np.finfo(float).tiny))


def _openness(mesh: trimesh.Trimesh, caster: RayCaster, faces: np.ndarray) -> float:
    """Return in which share of a half space some faces see out of the mesh, from either side."""
    piece = trimesh.Trimesh(mesh.vertices, mesh.faces[faces], process=False)
    if piece.area <= 0:
        return 1.0
    points, _, _ = sample_surface(piece, _SAMPLES, np.random.default_rng(0))
    directions = fibonacci_sphere(_DIRECTIONS)
    rays = np.repeat(directions[None], len(points), axis=0).reshape(-1, 3)
    origins = np.repeat(points, len(directions), axis=0) + 1e-4 * mesh.scale * rays
    _, hit = caster.first_hits(origins, rays)
    return float(2 * (hit < 0).mean())


def fibonacci_sphere(count: int) -> np.ndarray:
    """Return ``count`` unit vectors spread evenly over the sphere (golden spiral; Gonzalez 2010, eq. 1)."""
    i = np.arange(count)
    z = 1 - (2 * i + 1) / count
    azimuth = np.pi * (1 + np.sqrt(5)) * i
    radius = np.sqrt(1 - z**2)
    return np.stack((radius * np.cos(azimuth), radius * np.sin(azimuth), z), axis=1)
