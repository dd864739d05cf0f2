"""Open sheets: distinguish the mouth of a vessel from a hole in a solid, and thicken sheets inward to solids."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.repair.halfedges import BOUNDARY, halfedge_vertices
from manitwin.geometry.repair.surface import NEW, Surface, face_cross_products, face_normals
from manitwin.geometry.sampling import sample_surface

# largest displacement of a corner in thicknesses; sharper corners would intersect the opposite side
_MOST_STRETCH = 2.0
_DAMPING = 1e-2  # keeps vertices of flat neighbourhoods from sliding tangentially
_SHARE_OF_ROOM = 0.4  # fraction of the free distance inward, so that opposite walls do not meet

_SAMPLES = 32  # points per closing surface
_DIRECTIONS = 128  # rays per point
_FOLD_COSINE = 0.7
"""A lid deviates by 45 degrees or more on average from the wall around it; a patch continues its surface."""
_BAND = 0.25  # fraction of a patch's size: width of the surrounding band that is compared
_OPENNESS = 0.5  # fraction of the half space before a lid; a patch deep in a crevice sees less of the outside


def thicken(surface: Surface, thickness_m: float) -> Surface:
    """Thicken outward-oriented open sheets to closed walls; their rims become narrow bands.

    Requires one vertex per fan (``Surface.with_split_vertices``). The given faces are followed by their inner copies and two
    new faces per rim edge. The wall is thinner where less than 2.5 thicknesses are free inward.
    """
    count, old = len(surface.vertices), len(surface.faces)
    inner = surface.reversed(np.ones(old, dtype=bool))
    inner_vertices = surface.vertices - _inward_offsets(surface, thickness_m)
    rim = surface.boundary
    start, end = halfedge_vertices(surface.faces)
    a, b = start[rim], end[rim]
    first, second = np.stack((b, a, a + count), 1), np.stack((b, a + count, b + count), 1)
    band = np.stack((first, second), 1).reshape(-1, 3)
    twin = np.concatenate(
        (
            surface.twin,
            np.where(inner.twin >= 0, inner.twin + 3 * old, BOUNDARY),
            np.full(3 * len(band), BOUNDARY, dtype=np.int64),
        )
    )
    _glue_band(twin, rim, 3 * old, a, b, surface)
    fresh = old + len(band)
    return Surface(
        np.concatenate((surface.vertices, inner_vertices)),
        np.concatenate((surface.faces, inner.faces + count, band)),
        np.concatenate((surface.source, np.full(fresh, NEW))),
        np.concatenate((surface.flipped, np.zeros(fresh, dtype=bool))),
        twin,
    )


def _glue_band(
    twin: np.ndarray, rim: np.ndarray, inner_at: int, a: np.ndarray, b: np.ndarray, surface: Surface
) -> None:
    """Glue the band's faces to the outer and inner surface and to each other, in place.

    Rim edge r has the faces (b, a, a') and (b, a', b'), whose half-edges start at ``base[r]`` and ``base[r] + 3``.
    """
    base = 2 * inner_at + 6 * np.arange(len(rim))
    reversed_corner = np.array([1, 0, 2])
    inside = inner_at + rim - rim % 3 + reversed_corner[rim % 3]
    following = np.empty(len(surface.vertices), dtype=np.int64)
    following[a] = np.arange(len(rim))
    for one, other in (
        (base, rim),
        (base + 2, base + 3),
        (base + 4, inside),
        (base + 5, base[following[b]] + 1),
    ):
        twin[one], twin[other] = other, one


def _inward_offsets(surface: Surface, thickness_m: float) -> np.ndarray:
    """Return the displacement ``(V, 3)`` to subtract from every vertex; it points outward.

    It moves the planes of all adjacent faces by the thickness in the least-squares sense, weighted by corner angle (the quadric
    of Garland and Heckbert 1997, section 3.4); at a corner of a box it keeps the corner.
    """
    normals = np.repeat(face_normals(surface.vertices, surface.faces), 3, axis=0)
    weight = _corner_angles(surface)
    corners, count = surface.faces.ravel(), len(surface.vertices)

    def summed(values: np.ndarray) -> np.ndarray:
        return np.bincount(corners, weight * values, minlength=count)

    total = np.maximum(summed(np.ones(len(corners))), np.finfo(float).tiny)
    quadric = np.empty((count, 3, 3))
    for i in range(3):
        for j in range(3):
            quadric[:, i, j] = summed(normals[:, i] * normals[:, j]) / total
    mean_normal = np.stack([summed(normals[:, i]) / total for i in range(3)], axis=1)
    quadric += _DAMPING * np.eye(3)
    offset = np.linalg.solve(quadric, (1 + _DAMPING) * thickness_m * mean_normal[..., None])[..., 0]
    length = np.maximum(np.linalg.norm(offset, axis=1), np.finfo(float).tiny)
    direction = offset / length[:, None]
    room = _SHARE_OF_ROOM * _room_inward(surface, direction, thickness_m)
    return direction * np.minimum(np.minimum(length, _MOST_STRETCH * thickness_m), room)[:, None]


def _corner_angles(surface: Surface) -> np.ndarray:
    """Return the angle ``(3F,)`` of every corner in rad."""
    points = surface.vertices[surface.faces]
    onward, back = np.roll(points, -1, axis=1) - points, np.roll(points, 1, axis=1) - points
    sine = np.linalg.norm(np.cross(onward, back), axis=-1)
    return np.arctan2(sine, np.einsum("fki,fki->fk", onward, back)).ravel()


def _room_inward(surface: Surface, normal: np.ndarray, thickness_m: float) -> np.ndarray:
    """Return the free distance ``(V,)`` from every vertex along ``-normal (V, 3)``."""
    caster = RayCaster(trimesh.Trimesh(surface.vertices, surface.faces, process=False))
    skip = 0.1 * thickness_m
    distance, _ = caster.first_hits(surface.vertices - skip * normal, -normal)
    return skip + distance


def lids_of_openings(
    closed: Surface, loop_of_face: np.ndarray, rim_lengths: np.ndarray, lid_length_m: float, lid_area_share: float
) -> np.ndarray:
    """Return the loops whose patch would be a lid on an open sheet, ascending.

    A lid has a rim longer than ``lid_length_m`` and more than ``lid_area_share`` of its component's remaining area, deviates in
    direction from the surrounding faces, and sees the outside from most of its area. Patches in crevices that a scanner did not
    reach see little of the outside; large faces missing from a coarse mesh are coplanar with others or have a rim of three
    edges. ``loop_of_face (F,)`` is -1 for faces that belong to no patch.
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
    """Return the area-weighted mean cosine between the normal of a patch and those of the surrounding band.

    The band is the surface within a quarter of the patch's size from its rim, measured along faces. The rounded lip of a cup
    then counts less than the wall below it, and the far side of a thin plate not at all.
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
    """Return the share of a half space in which faces see out of the mesh, from either side."""
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
