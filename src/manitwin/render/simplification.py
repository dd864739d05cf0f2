"""Mesh simplification by vertex removal, for meshes drawn small and thousands of times.

On lavapipe a triangle costs more than the pixels it covers.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np

_ROUNDS = 30
_LEAST_GAIN = 0.02  # least share of vertices removed in a round for another one to follow
_LEAST_COSINE = 0.5  # between a triangle's normal before and after: no normal turns by more than 60 degrees
_FLATTEST = 0.01  # least ratio of twice a triangle's area to the sum of its squared sides, as slivers shade badly
_TRIES = 3  # neighbours into which a vertex may be collapsed, cheapest first
_CHEAP = 0.05  # fraction of the squared tolerance: costs below it count as zero
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
    """Return faces ``(G, 3)`` over the same vertices ``(V, 3)``, using as few vertices as the tolerance allows.

    A vertex is collapsed into a neighbour if the root of its quadric error is below ``tolerance_m``: roughly the distance from
    the planes of all triangles that it represents. Vertices of open edges are kept; without ``keep_open_edges`` they may move
    if the edge stays within the tolerance. ``places (V,)`` are point indices of the vertices: vertices at one point, as at a
    texture seam, move together along the seam. Each round collapses all vertices that cost less than their neighbours.

    Source: Garland and Heckbert 1997, "Surface Simplification Using Quadric Error Metrics", with subset placement and planes
    across open edges (section 6).
    """
    vertices, faces = np.asarray(vertices, float), np.asarray(faces, np.int64)
    if not len(faces):
        return faces
    places = np.arange(len(vertices)) if places is None else places
    points = np.empty((int(places.max()) + 1, 3))
    points[places] = vertices
    quadrics, products = _quadrics(points, places[faces]), _quadric_monomials(points)
    _add_planes_across_seams(quadrics, points, faces, places, keep_open_edges)
    for number in range(_ROUNDS):
        shuffle = (np.arange(1, len(points) + 1) * (number + 1) * _GOLDEN) % 1.0
        moves = _valid_collapses(faces, places, len(points), keep_open_edges)
        chosen = _round(points, places[faces], quadrics, products, moves, tolerance_m**2, shuffle)
        # several vertices may be collapsed into one
        np.add.at(quadrics, moves.end[chosen], quadrics[moves.start[chosen]])
        there = np.zeros(len(points), bool)
        there[places[faces]] = True
        faces = moves.applied(chosen, len(vertices))[faces]
        a, b, c = places[faces].T
        faces = faces[(a != b) & (b != c) & (c != a)]
        if len(chosen) < _LEAST_GAIN * np.count_nonzero(there):
            break
    return faces


@dataclass(frozen=True)
class _EdgeCollapses:
    """Collapses of points ``start (M,)`` into ``end (M,)``, with the vertices on both sides of the edge.

    ``vertices (2, 2, M)``: by side, from and to; equal for both sides unless the edge is on a seam.
    """

    start: np.ndarray
    end: np.ndarray
    vertices: np.ndarray

    def applied(self, chosen: np.ndarray, count: int) -> np.ndarray:
        """Return the vertex ``(count,)`` into which each vertex is collapsed by the chosen moves (most: itself)."""
        into = np.arange(count)
        for first, last in self.vertices[:, :, chosen]:
            into[first] = last
        return into


@dataclass(frozen=True)
class _HalfEdges:
    """The half-edges of faces ``(F, 3)``: vertices ``start`` and ``end (3F,)``, and those on the adjacent face's side.

    ``open``: without an adjacent face, in which case these are its own. ``doubled``: on a non-manifold or inconsistently wound
    edge.
    """

    start: np.ndarray
    end: np.ndarray
    other_start: np.ndarray
    other_end: np.ndarray
    open: np.ndarray
    doubled: np.ndarray

    @classmethod
    def from_faces(cls, faces: np.ndarray, places: np.ndarray, count: int) -> _HalfEdges:
        """Find the adjacent sides; ``count`` is the number of points."""
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


def _valid_collapses(faces: np.ndarray, places: np.ndarray, count: int, keep_open_edges: bool) -> _EdgeCollapses:
    """Return the edge collapses that preserve surface, open edges and seams; ``count`` is the number of points."""
    e = _HalfEdges.from_faces(faces, places, count)
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
    elif is_open.any():  # the reverse direction along open edges, which no face has
        sides = np.concatenate([sides, sides[:, ::-1, is_open]], axis=2)
        start, end = np.append(start, end[is_open]), np.append(end, start[is_open])
        is_open = np.append(is_open, np.ones(len(start) - len(is_open), bool))
    one = sides[0, 0] == sides[1, 0]
    whole = np.where(one, (sides[0, 1] == sides[1, 1]) & (vertices_at[start] == 1), vertices_at[start] == 2)
    possible = np.flatnonzero(whole & ~kept[start] & (is_open | ~(rim[start] & rim[end])))
    return _EdgeCollapses(start[possible], end[possible], sides[:, :, possible])


def _add_planes_across_seams(
    quadrics: np.ndarray, points: np.ndarray, faces: np.ndarray, places: np.ndarray, keep_open_edges: bool
) -> None:
    """Add planes through seams and open edges, perpendicular to their faces, to penalize moving off the edge."""
    e = _HalfEdges.from_faces(faces, places, len(points))
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
    """Return the quadric error forms ``(P, 10)``: sums of squared distances from the planes of each point's triangles.

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
    """Return squared distances from planes as quadratic forms ``(N, 10)``; normals ``(N, 3)`` of any length."""
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals / np.where(lengths > 0, lengths, 1)[:, None]
    planes = np.column_stack([normals, -(normals * through).sum(1)])
    return np.asarray(planes[:, _ROW] * planes[:, _COLUMN])


def _quadric_monomials(points: np.ndarray) -> np.ndarray:
    """Return the factors by which the forms of ``_quadrics`` are evaluated at each point ``(P, 10)``."""
    homogeneous = np.column_stack([points, np.ones(len(points))])
    return np.asarray(homogeneous[:, _ROW] * homogeneous[:, _COLUMN] * np.where(_ROW == _COLUMN, 1, 2))


def _round(
    points: np.ndarray,
    faces: np.ndarray,
    quadrics: np.ndarray,
    products: np.ndarray,
    moves: _EdgeCollapses,
    most: float,
    shuffle: np.ndarray,
) -> np.ndarray:
    """Return the indices of a round's moves, at most one per point and none for two neighbours; ``faces`` are point indices.

    Where all costs are small, ``shuffle (P,)`` in [0, 1] decides the order: in a chain of increasing costs only the first could
    move (Luby 1986, maximal independent sets).
    """
    cost = (np.take(quadrics, moves.start, axis=0) * np.take(products, moves.end, axis=0)).sum(1)
    number = np.flatnonzero(cost < most)
    start, end, cost = moves.start[number], moves.end[number], cost[number]
    length = ((points[end] - points[start]) ** 2).sum(1)
    order = np.lexsort((end, cost + 1e-4 * length, start))  # on ties the nearest
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
    """Return for each collapse whether no triangle flips or becomes a sliver."""
    goal = np.full(len(points), -1)
    goal[start] = end
    to = goal[faces]
    face, corner = np.nonzero(to >= 0)
    to = to[face, corner]
    stays = (faces[face] != to[:, None]).all(1)  # triangles with both ends vanish
    face, corner, to = face[stays], corner[stays], to[stays]
    now = np.take(points.T, faces[face].T, axis=1)  # (3, 3, M): coordinates by corners
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
    """Return the normals ``(3, M)`` of triangles ``(3 coordinates, 3 corners, M)``, with twice their area as length."""
    (a, b, c), (d, e, f) = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.stack([b * f - c * e, c * d - a * f, a * e - b * d])


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the scalar products ``(M,)`` of vectors ``(3, M)``."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
