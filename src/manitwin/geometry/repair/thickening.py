"""Open sheets made solid: the surface is the outside, a wall of some thickness grows inward."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.repair.halfedges import BOUNDARY, halfedge_vertices
from manitwin.geometry.repair.surface import NEW, Surface, face_normals

_MOST_STRETCH = 2.0  # a corner moves at most so many thicknesses: sharper ones would shoot through
_DAMPING = 1e-2  # keeps vertices of flat neighbourhoods from sliding along them
_SHARE_OF_ROOM = 0.4  # of the free way inward: opposite walls must not meet


def thicken(surface: Surface, thickness_m: float) -> Surface:
    """Turn outward wound open sheets into closed walls; their rims become narrow bands.

    Expects one vertex a fan (``Surface.with_split_vertices``). The given faces stay as they are, followed by their
    inner copies and two faces for each rim edge, all new. The wall is thinner where less than 2.5 thicknesses are free
    inward.
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
    """Glue the band's faces to the outside, to the inside and to each other, in place.

    Rim edge r has faces (b, a, a') and (b, a', b') whose half-edges begin at ``base[r]`` and ``base[r] + 3``.
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
    """Return ``(V, 3)`` by how much to move every vertex inward, as a vector that points outward.

    The displacement moves the planes of all faces around by the thickness in the least squares sense, weighted by
    the corner angle (the quadric of Garland and Heckbert 1997, section 3.4): at the edge of a box that is its corner.
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
    """Return the free distance ``(V,)`` from every vertex against ``normal (V, 3)``."""
    caster = RayCaster(trimesh.Trimesh(surface.vertices, surface.faces, process=False))
    skip = 0.1 * thickness_m
    distance, _ = caster.first_hits(surface.vertices - skip * normal, -normal)
    return skip + distance
