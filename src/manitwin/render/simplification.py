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
    quadrics, products = _quadrics(vertices, faces), _products(vertices)
    for number in range(_ROUNDS):
        shuffle = (np.arange(1, len(vertices) + 1) * (number + 1) * _GOLDEN) % 1.0
        moves = _round(vertices, faces, quadrics, products, kept, tolerance_m**2, shuffle)
        moved = np.flatnonzero(moves != np.arange(len(moves)))
        np.add.at(quadrics, moves[moved], quadrics[moved])  # several may move into one
        there = np.zeros(len(vertices), bool)
        there[faces] = True
        faces = moves[faces]
        a, b, c = faces.T
        faces = faces[(a != b) & (b != c) & (c != a)]
        if len(moved) < _LEAST_GAIN * np.count_nonzero(there):
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


def _products(vertices: np.ndarray) -> np.ndarray:
    """Return what the quadratic forms of ``_quadrics`` are multiplied with at each vertex ``(V, 10)``."""
    homogeneous = np.column_stack([vertices, np.ones(len(vertices))])
    return np.asarray(homogeneous[:, _ROW] * homogeneous[:, _COLUMN] * np.where(_ROW == _COLUMN, 1, 2))


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
    products: np.ndarray,
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
    cost = (np.take(quadrics, start, axis=0) * np.take(products, end, axis=0)).sum(1)
    cheap = cost < most
    start, end, cost = start[cheap], end[cheap], cost[cheap]
    length = ((vertices[end] - vertices[start]) ** 2).sum(1)
    order = np.lexsort((end, cost + 1e-4 * length, start))  # of equal ones the nearest
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
    to = goal[faces]
    face, corner = np.nonzero(to >= 0)
    to = to[face, corner]
    stays = (faces[face] != to[:, None]).all(1)  # those with both ends fall away
    face, corner, to = face[stays], corner[stays], to[stays]
    now = np.take(vertices.T, faces[face].T, axis=1)  # (3, 3, M): of each coordinate the corners
    then = now.copy()
    then[:, corner, np.arange(len(face))] = np.take(vertices.T, to, axis=1)
    before, after = _doubled_normals(now), _doubled_normals(then)
    longest = sum(_dot(side, side) for side in (then[:, i] - then[:, i - 1] for i in range(3)))
    area = np.sqrt(_dot(after, after))
    bad = _dot(before, after) < _LEAST_COSINE * np.sqrt(_dot(before, before)) * area
    bad |= area < _FLATTEST * longest
    good = np.ones(len(vertices), bool)
    good[faces[face[bad], corner[bad]]] = False
    return good[start]


def _doubled_normals(corners: np.ndarray) -> np.ndarray:
    """Return the normals ``(3, M)`` of triangles ``(3 coordinates, 3 corners, M)``, twice as long as their areas are large."""
    (a, b, c), (d, e, f) = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.stack([b * f - c * e, c * d - a * f, a * e - b * d])


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the scalar products ``(M,)`` of vectors ``(3, M)``."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
