"""Closing of texture seams, where one position has several vertices, with degenerate triangles.

A glTF vertex has one normal and one texture coordinate, so that a closed textured or creased solid has borders where its charts
meet. Tools that only compare indices take it for an open sheet without volume and inertia, and report "not watertight". The two
sides of each seam are joined by triangles with coincident corners: nothing more is drawn, and the solid is closed.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


def close_seams(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Close the seams of a mesh; true borders stay open.

    ``vertices (V, 3)``, ``faces (F, 3)``. Returns the new vertices as indices ``(W,)`` into the given ones, and faces ``(G,
    3)``: the given faces first, then triangles with at least two corners at one position, which join every border edge to the
    opposite edge at the same position. Without seams, both are returned unchanged.
    """
    borders = _border_edges(faces)
    if not len(borders):
        return np.arange(len(vertices)), faces
    source, split = _split_fans(faces, len(vertices))
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    joined = _join(_border_edges(split), place.reshape(-1)[source])
    return source, np.concatenate([split, np.array(joined, np.int64).reshape(-1, 3)])


def _split_fans(faces: np.ndarray, vertex_count: int) -> tuple[np.ndarray, np.ndarray]:
    """Split vertices so that every fan of faces has its own vertex; two fans then meet along at most one seam.

    Returns for each new vertex the old index ``(W,)``, and the faces in new indices. Unused vertices are dropped.
    """
    corner = np.arange(3 * len(faces)).reshape(-1, 3)
    a, b = (np.concatenate([faces[:, i], faces[:, (i + 1) % 3], faces[:, (i + 2) % 3]]) for i in (0, 1))
    at_a, at_b = (np.concatenate([corner[:, i], corner[:, (i + 1) % 3], corner[:, (i + 2) % 3]]) for i in (0, 1))
    order, opposite = np.argsort(a * vertex_count + b), np.argsort(b * vertex_count + a)
    forward, backward = (a * vertex_count + b)[order], (b * vertex_count + a)[opposite]
    found = np.searchsorted(forward, backward)
    paired = (found < len(forward)) & (forward[np.minimum(found, len(forward) - 1)] == backward)
    one, other = opposite[paired], order[found[paired]]
    links = np.concatenate([np.stack([at_a[one], at_b[other]], 1), np.stack([at_b[one], at_a[other]], 1)])
    graph = coo_matrix((np.ones(len(links), bool), links.T), shape=(corner.size, corner.size))
    _, wedge = connected_components(graph, directed=False)
    _, first = np.unique(wedge, return_index=True)
    return faces.reshape(-1)[first], wedge[corner].astype(np.int64)


def has_distinct_corners(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return a mask ``(F,)`` of the faces with three distinct corner positions."""
    corners = vertices[faces]
    same = [(corners[:, i] == corners[:, (i + 1) % 3]).all(1) for i in range(3)]
    return ~np.logical_or.reduce(same)


def _border_edges(faces: np.ndarray) -> np.ndarray:
    """Return the directed edges ``(B, 2)`` without an opposite edge in any face, in the order of the faces."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    count = int(faces.max()) + 1
    forward, backward = edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]
    return edges[~np.isin(forward, backward)]


def _join(borders: np.ndarray, place: np.ndarray) -> list[tuple[int, int, int]]:
    """Bridge each border edge to its counterpart, and fill the polygons that remain open around one position."""
    waiting: dict[tuple[int, int], list[tuple[int, int]]] = defaultdict(list)
    triangles: list[tuple[int, int, int]] = []
    rungs: dict[tuple[int, int], int] = defaultdict(int)
    for a, b in borders.tolist():
        ends = (int(place[a]), int(place[b]))
        partners = waiting.get((ends[1], ends[0]))
        if not partners:
            waiting[ends].append((a, b))
            continue
        c, d = partners.pop(0)  # c coincides with b, d with a
        if b != c:
            triangles.append((b, a, c))
            rungs[(c, b)] += 1
        if a != d:
            triangles.append((c, a, d) if b != c else (b, a, d))
            rungs[(a, d)] += 1
    for polygon in _polygons(rungs):
        triangles += [(polygon[0], polygon[i + 1], polygon[i]) for i in range(1, len(polygon) - 1)]
    return triangles


def _polygons(rungs: dict[tuple[int, int], int]) -> list[list[int]]:
    """Return the closed loops of the directed edges that have no opposite edge."""
    following: dict[int, list[int]] = defaultdict(list)
    for (a, b), count in rungs.items():
        for _ in range(count - min(count, rungs.get((b, a), 0))):
            following[a].append(b)
    loops = []
    for start in sorted(following):
        while following[start]:
            loop = [start]
            while (after := following[loop[-1]].pop()) != start:
                loop.append(after)
                if not following[after]:
                    break
            else:
                loops.append(loop)
    return loops
