"""Sampling of points on surfaces, and farthest point sampling."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import trimesh


def sample_surface(
    mesh: trimesh.Trimesh, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sample surface points uniformly by area.

    Returns points ``(count, 3)`` m, the outward unit normals of their faces ``(count, 3)``, and face indices ``(count,)``.

    Source: paper, "Candidate Point Sampling"; barycentric sampling of Osada et al. 2002, eq. 1.
    """
    cumulative = np.cumsum(mesh.area_faces)
    drawn = rng.random(count) * cumulative[-1]
    order, faces = np.argsort(drawn), np.empty(count, np.int64)
    faces[order] = np.searchsorted(cumulative, drawn[order])  # sorted queries are twice as fast
    faces = np.minimum(faces, len(mesh.faces) - 1)
    root, along = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
    corners = np.asarray(mesh.triangles).reshape(-1, 9).take(faces, axis=0)
    a, b, c = corners[:, :3], corners[:, 3:6], corners[:, 6:]
    return (1 - root) * a + root * (1 - along) * b + root * along * c, mesh.face_normals[faces], faces


def farthest_point_sampling(points: np.ndarray, count: int, start: int = 0) -> np.ndarray:
    """Return the indices of ``count`` of the points ``(N, D)``, each the farthest from those chosen before (paper, eq. 1).

    Starts at index ``start``; returns all indices if there are no more than ``count`` points.
    """
    if len(points) <= count:
        return np.arange(len(points))
    chosen = np.empty(count, dtype=np.int64)
    chosen[0] = start
    nearest = np.full(len(points), np.inf)
    for i in range(1, count):
        nearest = np.minimum(nearest, ((points - points[chosen[i - 1]]) ** 2).sum(1))
        chosen[i] = int(nearest.argmax())
    return chosen
