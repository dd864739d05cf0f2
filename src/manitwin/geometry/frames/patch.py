"""Flat surface patches: connected faces around a point that lie in one plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from manitwin.geometry.frames.feature import FramedMesh

_WIDTHS = (2.0, 1.5, 1.5, 1.0, 1.0, 1.0)
"""Multiples of slab thickness and angle, per round of fitting the plane and growing the patch."""


@dataclass(frozen=True)
class Patch:
    """A flat patch: face indices, centre, outward normal ``(3,)``, area (m2), and RMS distance from its plane (m).

    ``long_axis (3,)`` is the in-plane direction of the longer side, ``elongation`` the aspect ratio.
    """

    faces: np.ndarray
    center_m: np.ndarray
    normal: np.ndarray
    area_m2: float
    rough_m: float
    long_axis: np.ndarray
    elongation: float


def flat_patch(
    surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray, *, angle_rad: float, thick_m: float
) -> Patch | None:
    """Return the connected faces near a point with normals within an angle and centres within a slab of a fitted plane.

    The plane starts at the point with the given outward normal and is refitted to the patch. None if no such face is near the
    point (5 % of the longest side).
    """
    corners, centers, normals, areas = surface.corners
    origin, chosen = point_m, np.zeros(0, dtype=int)
    for wide in _WIDTHS:
        inside = (normals @ normal > np.cos(wide * angle_rad)) & (np.abs((centers - origin) @ normal) < wide * thick_m)
        members = np.flatnonzero(inside)
        if not len(members):
            return None
        component = _components(corners[members])
        away = np.linalg.norm(surface.mesh.triangles[members] - point_m, axis=2).min(1)
        away = np.minimum(away, np.linalg.norm(centers[members] - point_m, axis=1))
        away = np.where(_above(surface, members, point_m, normal), 0.0, away)
        nearest = int(away.argmin())
        if away[nearest] > 0.05 * surface.size_m:
            return None
        chosen = members[component == component[nearest]]
        weight = areas[chosen] / areas[chosen].sum()
        mean = weight @ normals[chosen]
        normal, origin = mean / np.linalg.norm(mean), weight @ centers[chosen]
    return _measure_patch(surface, chosen, normal, origin)


def _components(corners: np.ndarray) -> np.ndarray:
    """Return a component label for each face ``(N, 3)``, connected through shared vertices."""
    face = np.repeat(np.arange(len(corners)), 3)
    _, corner = np.unique(corners, return_inverse=True)
    count = len(corners) + int(corner.max()) + 1
    graph = coo_array((np.ones(len(face)), (face, len(corners) + corner.reshape(-1))), shape=(count, count))
    return connected_components(graph, directed=False)[1][: len(corners)]


def _above(surface: FramedMesh, faces: np.ndarray, point_m: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return which faces contain a point in projection along a normal; all corners of a large face may be far away."""
    triangles = surface.mesh.triangles[faces] - point_m
    turns = np.stack([np.cross(triangles[:, i], triangles[:, (i + 1) % 3]) @ normal for i in range(3)], axis=1)
    return np.asarray((turns >= 0).all(1) | (turns <= 0).all(1))


def _measure_patch(surface: FramedMesh, faces: np.ndarray, normal: np.ndarray, center_m: np.ndarray) -> Patch:
    _, _, _, areas = surface.corners
    triangles = surface.mesh.triangles[faces] - center_m
    weight = areas[faces] / areas[faces].sum()
    total = triangles.sum(1)  # second moment of a triangle about the origin: (sum of corners, each corner) / 12
    second = np.einsum("n,nki,nkj->ij", weight, triangles, triangles) + np.einsum("n,ni,nj->ij", weight, total, total)
    plane = np.eye(3) - np.outer(normal, normal)
    values, vectors = np.linalg.eigh(plane @ second @ plane / 12)
    rough = float(np.sqrt(max(normal @ second @ normal / 12, 0.0)))
    elongation = float(np.sqrt(values[2] / max(values[1], 1e-18)))
    return Patch(faces, center_m, normal, float(areas[faces].sum()), rough, vectors[:, 2], elongation)
