"""Fewer triangles for the same picture: vertices that a surface can do without, taken out.

For meshes that are drawn small and thousands of times: on lavapipe a triangle costs more than the pixels it covers.
"""

from __future__ import annotations

from itertools import permutations

import numpy as np

_ROUNDS = 30
_LEAST_GAIN = 0.02  # share of the vertices that a round must take out for another one to follow
_LEAST_COSINE = 0.5  # between a triangle's normal before and after: none turns by more than 60 degrees
_FLATTEST = 0.01  # of twice a triangle's area in the sum of its sides' squares: slivers shade badly
_TRIES = 3  # neighbours that a vertex may move into, the cheapest first
_CHEAP = 0.05  # of the squared tolerance: what costs less than that counts as nothing
_GOLDEN = (5**0.5 - 1) / 2
_ROW, _COLUMN = np.triu_indices(4)


def simplified(vertices: np.ndarray, faces: np.ndarray, tolerance_m: float) -> np.ndarray:
    """Return faces ``(G, 3)`` over the same vertices ``(V, 3)``, with as many vertices left out as the tolerance allows.

    A vertex goes by moving into a neighbour, where the root of its quadric error stays below ``tolerance_m``: roughly the
    distance from the planes of all triangles that it stands for. Vertices of open edges stay.
    In each round all vertices go that cost less than their neighbours.
    Source: Garland and Heckbert 1997, "Surface Simplification Using Quadric Error Metrics", with subset placement.
    """
    vertices, faces = np.asarray(vertices, float), np.asarray(faces, np.int64)
    if not len(faces):
        return faces
    kept = _of_open_edges(faces, len(vertices))
    quadrics = _quadrics(vertices, faces)
    for number in range(_ROUNDS):
        shuffle = (np.arange(1, len(vertices) + 1) * (number + 1) * _GOLDEN) % 1.0
        moves = _round(vertices, faces, quadrics, kept, tolerance_m**2, shuffle)
        moved = np.flatnonzero(moves != np.arange(len(moves)))
        np.add.at(quadrics, moves[moved], quadrics[moved])  # several may move into one
        there = len(np.unique(faces))
        faces = moves[faces]
        a, b, c = faces.T
        faces = faces[(a != b) & (b != c) & (c != a)]
        if len(moved) < _LEAST_GAIN * there:
            break
    return faces


def _quadrics(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the sum of squared distances from the planes of each vertex's triangles as quadratic forms ``(V, 10)``.

    They are the upper triangles of symmetric 4 x 4 matrices, row by row.
    """
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    normals /= np.where(lengths > 0, lengths, 1)[:, None]
    planes = np.column_stack([normals, -(normals * corners[:, 0]).sum(1)])
    forms = planes[:, _ROW] * planes[:, _COLUMN]
    order = np.argsort(faces.ravel(), kind="stable")
    present, first = np.unique(faces.ravel()[order], return_index=True)
    quadrics = np.zeros((len(vertices), 10))
    quadrics[present] = np.add.reduceat(forms[order // 3], first, axis=0)
    return quadrics


def _of_open_edges(faces: np.ndarray, count: int) -> np.ndarray:
    """Tell which vertices lie on edges that have not exactly two triangles; returns ``(count,) bool``."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, first, uses = np.unique(edges[:, 0] * count + edges[:, 1], return_index=True, return_counts=True)
    found = np.zeros(count, bool)
    found[edges[first[uses != 2]]] = True
    return found


def _round(
    vertices: np.ndarray,
    faces: np.ndarray,
    quadrics: np.ndarray,
    kept: np.ndarray,
    most: float,
    shuffle: np.ndarray,
) -> np.ndarray:
    """Return the vertex ``(V,)`` that each one moves into, most into themselves; no two neighbours move.

    Where all costs are small ``shuffle (V,)``, between 0 and 1, decides who goes first: in a row of growing costs only the
    first one could (Luby 1986, maximal independent sets).
    """
    # around a vertex that is not on an open edge, the edges that its triangles begin there lead to all its neighbours
    start, end = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    free = ~kept[start]
    start, end = start[free], end[free]
    homogeneous = np.column_stack([vertices, np.ones(len(vertices))])
    products = homogeneous[:, _ROW] * homogeneous[:, _COLUMN] * np.where(_ROW == _COLUMN, 1, 2)
    cost = (quadrics[start] * products[end]).sum(1)
    length = ((vertices[end] - vertices[start]) ** 2).sum(1)
    order = np.lexsort((end, cost + 1e-4 * length, start))  # of equal ones the nearest
    order = order[cost[order] < most]
    start, end, cost = start[order], end[order], cost[order]
    moves, price = np.arange(len(vertices)), np.full(len(vertices), np.inf)
    for _ in range(_TRIES):
        first = np.ones(len(start), bool)
        first[1:] = start[1:] != start[:-1]
        tried, goal = start[first], end[first]
        fits = _keeps_shape(vertices, faces, tried, goal)
        moves[tried[fits]] = goal[fits]
        price[tried[fits]] = (cost[first][fits] + _CHEAP * most) * (1 + shuffle[tried[fits]])
        left = ~first & (moves[start] == start)
        start, end, cost = start[left], end[left], cost[left]
    least = np.full(len(vertices), np.inf)
    for here, there in permutations(range(3), 2):
        np.minimum.at(least, faces[:, here], price[faces[:, there]])
    return np.where(price < least, moves, np.arange(len(vertices)))


def _keeps_shape(vertices: np.ndarray, faces: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Tell for each vertex and the one it would move into whether no triangle turns over or becomes a sliver."""
    goal = np.full(len(vertices), -1)
    goal[start] = end
    good = np.ones(len(vertices), bool)
    for corner in range(3):
        to = goal[faces[:, corner]]
        moving = np.flatnonzero(to >= 0)
        moving = moving[(faces[moving] != to[moving, None]).all(1)]  # those with both ends fall away
        now = vertices[faces[moving]]
        then = now.copy()
        then[:, corner] = vertices[to[moving]]
        before, after = (np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]) for t in (now, then))
        longest = sum(((then[:, i] - then[:, i - 1]) ** 2).sum(1) for i in range(3))
        area = np.linalg.norm(after, axis=1)
        bad = (before * after).sum(1) < _LEAST_COSINE * np.linalg.norm(before, axis=1) * area
        bad |= area < _FLATTEST * longest
        good[faces[moving[bad], corner]] = False
    return good[start]
