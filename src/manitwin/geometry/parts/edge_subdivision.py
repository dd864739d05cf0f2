"""Subdivision of long mesh edges; both faces at an edge are split at the same point, so closed meshes stay closed."""

from __future__ import annotations

import numpy as np

_MOST_ROUNDS = 12  # of halving: down to 1/4096 of the longest edge
_MOST_PIECES = 30_000


def subdivide_long_edges(
    vertices: np.ndarray, faces: np.ndarray, longest_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices ``(V, 3)``, faces ``(P, 3)`` without edges over ``longest_m``, and the original face of each ``(P,)``.

    Only long edges are halved. Subdivision stops at tens of thousands of pieces, for meshes with many slivers.
    """
    vertices, faces, of_face = np.asarray(vertices, float), np.asarray(faces, np.int64), np.arange(len(faces))
    for _ in range(_MOST_ROUNDS):
        edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
        key, index = np.unique(edges[:, 0] * len(vertices) + edges[:, 1], return_inverse=True)
        ends = np.stack([key // len(vertices), key % len(vertices)], axis=1)
        long = np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1) > longest_m
        if not long.any() or len(faces) > _MOST_PIECES:
            break
        middle = np.where(long, len(vertices) + np.cumsum(long) - 1, -1)
        vertices = np.concatenate([vertices, vertices[ends[long]].mean(axis=1)])
        faces, parent = _halved(faces, middle[index.reshape(-1, 3)])
        of_face = of_face[parent]
    return vertices, faces, of_face


def _halved(faces: np.ndarray, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split faces ``(F, 3)`` at the midpoints ``(F, 3)`` of their edges (from each corner to the next; -1: not split).

    Returns the new faces and the original face of each.
    """
    count = (middle >= 0).sum(1)
    number = np.arange(len(faces))
    pieces, parents = [faces[count == 0]], [number[count == 0]]
    for cuts, first in ((1, middle >= 0), (2, np.roll(middle, 1, axis=1) < 0)):
        rows = np.flatnonzero(count == cuts)
        turn = first[rows].argmax(1)  # the corner at which the one cut edge, or the first of two, begins
        order = (turn[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(faces[rows], order, 1).T
        m, n, _ = np.take_along_axis(middle[rows], order, 1).T
        new = [(a, m, c), (m, b, c)] if cuts == 1 else [(a, m, c), (m, n, c), (m, b, n)]
        pieces += [np.stack(corners, axis=1) for corners in new]
        parents += [number[rows]] * len(new)
    rows = np.flatnonzero(count == 3)
    (a, b, c), (m, n, o) = faces[rows].T, middle[rows].T
    pieces += [np.stack(corners, axis=1) for corners in ((a, m, o), (m, b, n), (o, n, c), (m, n, o))]
    parents += [number[rows]] * 4
    return np.concatenate(pieces), np.concatenate(parents)
