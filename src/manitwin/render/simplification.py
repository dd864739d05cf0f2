"""Fewer triangles for the same picture: vertices that a surface can do without, taken out.

For meshes that are drawn small and thousands of times: on lavapipe a triangle costs more than the pixels it covers.
"""

from __future__ import annotations

from dataclasses import dataclass
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


def simplified(
    vertices: np.ndarray,
    faces: np.ndarray,
    tolerance_m: float,
    *,
    places: np.ndarray | None = None,
    keep_open_edges: bool = True,
) -> np.ndarray:
    """Return faces ``(G, 3)`` over the same vertices ``(V, 3)``, with as many vertices left out as the tolerance allows.

    A vertex goes by moving into a neighbour, where the root of its quadric error stays below ``tolerance_m``: roughly the
    distance from the planes of all triangles that it stands for. Vertices of open edges stay, or move without
    ``keep_open_edges`` where the edge stays within the tolerance. ``places (V,)`` number the points at which vertices are:
    several at one, as at the seam of a texture, move together, along the seam.
    In each round all vertices go that cost less than their neighbours.
    Source: Garland and Heckbert 1997, "Surface Simplification Using Quadric Error Metrics", with subset placement and
    planes across open edges (section 6).
    """
    vertices, faces = np.asarray(vertices, float), np.asarray(faces, np.int64)
    if not len(faces):
        return faces
    places = np.arange(len(vertices)) if places is None else places
    points = np.empty((int(places.max()) + 1, 3))
    points[places] = vertices
    quadrics, products = _quadrics(points, places[faces]), _products(points)
    _add_planes_across_seams(quadrics, points, faces, places, keep_open_edges)
    for number in range(_ROUNDS):
        shuffle = (np.arange(1, len(points) + 1) * (number + 1) * _GOLDEN) % 1.0
        moves = _possible_moves(faces, places, len(points), keep_open_edges)
        chosen = _round(points, places[faces], quadrics, products, moves, tolerance_m**2, shuffle)
        np.add.at(quadrics, moves.end[chosen], quadrics[moves.start[chosen]])  # several may move into one
        there = np.zeros(len(points), bool)
        there[places[faces]] = True
        faces = moves.applied(chosen, len(vertices))[faces]
        a, b, c = places[faces].T
        faces = faces[(a != b) & (b != c) & (c != a)]
        if len(chosen) < _LEAST_GAIN * np.count_nonzero(there):
            break
    return faces


@dataclass(frozen=True)
class _Moves:
    """Places ``start (M,)`` that may move into ``end (M,)``; on either side of the edge a vertex goes into another one.

    ``vertices (2, 2, M)``: by side, from and to; the same where the edge is none of a seam, or has one side.
    """

    start: np.ndarray
    end: np.ndarray
    vertices: np.ndarray

    def applied(self, chosen: np.ndarray, count: int) -> np.ndarray:
        """Return the vertex ``(count,)`` that each one goes into with the chosen moves, most into themselves."""
        into = np.arange(count)
        for first, last in self.vertices[:, :, chosen]:
            into[first] = last
        return into


@dataclass(frozen=True)
class _HalfEdges:
    """Of faces ``(F, 3)``, three each: vertices ``start`` and ``end (3F,)``, and those of the other side's face.

    ``open``: without another side, where these are its own. ``doubled``: another one runs the same way.
    """

    start: np.ndarray
    end: np.ndarray
    other_start: np.ndarray
    other_end: np.ndarray
    open: np.ndarray
    doubled: np.ndarray

    @classmethod
    def of(cls, faces: np.ndarray, places: np.ndarray, count: int) -> _HalfEdges:
        """Find the other sides; ``count`` places."""
        start, end = faces.ravel(), faces[:, [1, 2, 0]].ravel()
        first, last = places[start], places[end]
        key = np.minimum(first, last) * count + np.maximum(first, last)
        order = np.argsort(key)
        begins = np.flatnonzero(np.diff(key[order], prepend=-1))
        uses = np.diff(begins, append=len(key))
        a, b = order[begins[uses == 2]], order[begins[uses == 2] + 1]
        other, doubled = np.full(len(key), -1), np.zeros(len(key), bool)
        other[a], other[b] = b, a
        doubled[order] = np.repeat(uses > 2, uses)
        alike = first[a] == first[b]
        doubled[a[alike]] = doubled[b[alike]] = True
        is_open = other < 0
        other_start, other_end = np.where(is_open, start, end[other]), np.where(is_open, end, start[other])
        return cls(start, end, other_start, other_end, is_open, doubled)


def _possible_moves(faces: np.ndarray, places: np.ndarray, count: int, keep_open_edges: bool) -> _Moves:
    """Return the moves along edges that leave surface, open edges and seams whole, of ``count`` places."""
    e = _HalfEdges.of(faces, places, count)
    used = np.zeros(len(places), bool)
    used[faces] = True
    vertices_at = np.bincount(places[used], minlength=count)
    kept, rim = np.zeros(count, bool), np.zeros(count, bool)
    kept[places[e.start[e.doubled]]] = kept[places[e.end[e.doubled]]] = True
    rim[places[e.start[e.open]]] = rim[places[e.end[e.open]]] = True
    sides = np.stack([np.stack([e.start, e.end]), np.stack([e.other_start, e.other_end])])
    start, end, is_open = places[e.start], places[e.end], e.open
    if keep_open_edges:
        kept |= rim
    elif is_open.any():  # the other way along open edges, which no face has
        sides = np.concatenate([sides, sides[:, ::-1, is_open]], axis=2)
        start, end = np.append(start, end[is_open]), np.append(end, start[is_open])
        is_open = np.append(is_open, np.ones(len(start) - len(is_open), bool))
    one = sides[0, 0] == sides[1, 0]
    whole = np.where(one, (sides[0, 1] == sides[1, 1]) & (vertices_at[start] == 1), vertices_at[start] == 2)
    possible = np.flatnonzero(whole & ~kept[start] & (is_open | ~(rim[start] & rim[end])))
    return _Moves(start[possible], end[possible], sides[:, :, possible])


def _add_planes_across_seams(
    quadrics: np.ndarray, points: np.ndarray, faces: np.ndarray, places: np.ndarray, keep_open_edges: bool
) -> None:
    """Add planes through seams and open edges, upright on their faces: what moves along an edge leaves its line no further."""
    e = _HalfEdges.of(faces, places, len(points))
    held = (e.start != e.other_start) | (e.end != e.other_end)
    if not keep_open_edges:
        held |= e.open
    edges = np.flatnonzero(held)
    if not len(edges):
        return
    corners = points[places[faces[edges // 3]]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    start, end = places[e.start[edges]], places[e.end[edges]]
    forms = _forms(np.cross(normals, points[end] - points[start]), points[start])
    np.add.at(quadrics, start, forms)
    np.add.at(quadrics, end, forms)


def _quadrics(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the sum of squared distances from the planes of each point's triangles as quadratic forms ``(P, 10)``.

    They are the upper triangles of symmetric 4 x 4 matrices, row by row.
    """
    corners = points[faces]
    forms = _forms(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), corners[:, 0])
    order = np.argsort(faces.ravel(), kind="stable")
    present, first = np.unique(faces.ravel()[order], return_index=True)
    quadrics = np.zeros((len(points), 10))
    quadrics[present] = np.add.reduceat(forms[order // 3], first, axis=0)
    return quadrics


def _forms(normals: np.ndarray, through: np.ndarray) -> np.ndarray:
    """Return the squared distances from planes as quadratic forms ``(N, 10)``; normals ``(N, 3)`` of any length."""
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals / np.where(lengths > 0, lengths, 1)[:, None]
    planes = np.column_stack([normals, -(normals * through).sum(1)])
    return np.asarray(planes[:, _ROW] * planes[:, _COLUMN])


def _products(points: np.ndarray) -> np.ndarray:
    """Return what the quadratic forms of ``_quadrics`` are multiplied with at each point ``(P, 10)``."""
    homogeneous = np.column_stack([points, np.ones(len(points))])
    return np.asarray(homogeneous[:, _ROW] * homogeneous[:, _COLUMN] * np.where(_ROW == _COLUMN, 1, 2))


def _round(
    points: np.ndarray,
    faces: np.ndarray,
    quadrics: np.ndarray,
    products: np.ndarray,
    moves: _Moves,
    most: float,
    shuffle: np.ndarray,
) -> np.ndarray:
    """Return the indices of the moves of a round, one a point at most; no two neighbours move. ``faces`` are of points.

    Where all costs are small ``shuffle (P,)``, between 0 and 1, decides who goes first: in a row of growing costs only the
    first one could (Luby 1986, maximal independent sets).
    """
    cost = (np.take(quadrics, moves.start, axis=0) * np.take(products, moves.end, axis=0)).sum(1)
    number = np.flatnonzero(cost < most)
    start, end, cost = moves.start[number], moves.end[number], cost[number]
    length = ((points[end] - points[start]) ** 2).sum(1)
    order = np.lexsort((end, cost + 1e-4 * length, start))  # of equal ones the nearest
    number, start, end, cost = number[order], start[order], end[order], cost[order]
    taken, price = np.full(len(points), -1), np.full(len(points), np.inf)
    for _ in range(_TRIES):
        first = np.ones(len(start), bool)
        first[1:] = start[1:] != start[:-1]
        tried = start[first]
        fits = _keeps_shape(points, faces, tried, end[first])
        taken[tried[fits]] = number[first][fits]
        price[tried[fits]] = (cost[first][fits] + _CHEAP * most) * (1 + shuffle[tried[fits]])
        left = ~first & (taken[start] < 0)
        number, start, end, cost = number[left], start[left], end[left], cost[left]
    least = np.full(len(points), np.inf)
    for here, there in permutations(range(3), 2):
        np.minimum.at(least, faces[:, here], price[faces[:, there]])
    return np.asarray(taken[price < least])


def _keeps_shape(points: np.ndarray, faces: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Tell for each point and the one it would move into whether no triangle turns over or becomes a sliver."""
    goal = np.full(len(points), -1)
    goal[start] = end
    to = goal[faces]
    face, corner = np.nonzero(to >= 0)
    to = to[face, corner]
    stays = (faces[face] != to[:, None]).all(1)  # those with both ends fall away
    face, corner, to = face[stays], corner[stays], to[stays]
    now = np.take(points.T, faces[face].T, axis=1)  # (3, 3, M): of each coordinate the corners
    then = now.copy()
    then[:, corner, np.arange(len(face))] = np.take(points.T, to, axis=1)
    before, after = _doubled_normals(now), _doubled_normals(then)
    longest = sum(_dot(side, side) for side in (then[:, i] - then[:, i - 1] for i in range(3)))
    area = np.sqrt(_dot(after, after))
    bad = _dot(before, after) < _LEAST_COSINE * np.sqrt(_dot(before, before)) * area
    bad |= area < _FLATTEST * longest
    good = np.ones(len(points), bool)
    good[faces[face[bad], corner[bad]]] = False
    return good[start]


def _doubled_normals(corners: np.ndarray) -> np.ndarray:
    """Return the normals ``(3, M)`` of triangles ``(3 coordinates, 3 corners, M)``, twice as long as their areas are large."""
    (a, b, c), (d, e, f) = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.stack([b * f - c * e, c * d - a * f, a * e - b * d])


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the scalar products ``(M,)`` of vectors ``(3, M)``."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
