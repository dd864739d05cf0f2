"""Edges of a mesh along the border of a region: faces that it crosses are cut, their neighbours split where it meets them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

STEPS = 40
"""Halvings by which a crossing of an edge is found: to 1e-12 of its length."""
SNAP = 0.005
"""Of an edge: a crossing so near to its end is taken to be that end, which makes no slivers."""


def with_border(
    vertices: np.ndarray, faces: np.ndarray, chosen: np.ndarray, where: Callable[[np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Cut chosen faces along the border of a region of space, and return vertices, faces, the face each is of, and who is within.

    ``vertices (V, 3)``, ``faces (F, 3)``, ``chosen (F,)`` bool, ``where`` from places ``(N, 3)`` to bool ``(N,)``. New vertices
    lie on edges, which are split in the faces beside them too, so that the surface keeps its shape and stays closed. Between two
    edges the border is straight. Faces that are not cut are within where their centre is; no face is that is not chosen.
    """
    within = where(vertices)
    edges, of_edge = np.unique(
        np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_inverse=True
    )
    of_edge = of_edge.reshape(-1, 3)  # the edges from each corner of a face to the next
    crossed = np.zeros(len(edges), dtype=bool)
    crossed[of_edge[chosen]] = True
    crossed &= within[edges[:, 0]] != within[edges[:, 1]]
    numbers = np.flatnonzero(crossed)
    share = _crossings(vertices[edges[numbers, 0]], vertices[edges[numbers, 1]], within[edges[numbers, 0]], where)
    side = np.where(within, 1, -1)
    side[edges[numbers[share < SNAP], 0]] = 0
    side[edges[numbers[share > 1 - SNAP], 1]] = 0
    kept = (side[edges[numbers]] != 0).all(axis=1)
    numbers, share = numbers[kept], share[kept, None]
    cut_at = np.full(len(edges), -1)
    cut_at[numbers] = len(vertices) + np.arange(len(numbers))
    places = np.concatenate([vertices, (1 - share) * vertices[edges[numbers, 0]] + share * vertices[edges[numbers, 1]]])
    side = np.concatenate([side, np.zeros(len(numbers), dtype=side.dtype)])

    whole = np.asarray((cut_at[of_edge] < 0).all(axis=1))
    pieces, of_face = [faces[whole]], [np.flatnonzero(whole)]
    for number in np.flatnonzero(~whole):
        cut = _pieces(faces[number], cut_at[of_edge[number]], places)
        pieces.append(cut)
        of_face.append(np.full(len(cut), number))
    result, origin = np.concatenate(pieces), np.concatenate(of_face)
    signs = side[result].sum(axis=1)  # of pieces all corners are on one side of the border or on it
    inside = np.where(whole[origin] | (signs == 0), where(places[result].mean(axis=1)), signs > 0)
    return places, result, origin, inside & chosen[origin]


def _crossings(
    starts: np.ndarray, ends: np.ndarray, within: np.ndarray, where: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Return the shares ``(N,)`` of edges ``(N, 3)`` to ``(N, 3)`` at which a border crosses them, by bisection."""
    low, high = np.zeros(len(starts)), np.ones(len(starts))
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        same = where(starts + middle[:, None] * (ends - starts)) == within
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return 0.5 * (low + high)


def _pieces(corners: np.ndarray, cut_at: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the triangles ``(K, 3)`` of one with vertices ``cut_at (3,)`` on its edges, each behind its corner; -1 for none."""
    cuts = np.flatnonzero(cut_at >= 0)
    if len(cuts) == 3:
        a, b, c = corners
        ab, bc, ca = cut_at
        return np.array([(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)])
    if len(cuts) == 1:
        first = int(cuts[0])
        a, b, c = np.roll(corners, -first)
        return np.array([(a, cut_at[first], c), (cut_at[first], b, c)])
    uncut = int(np.flatnonzero(cut_at < 0)[0])
    a, b, c = np.roll(corners, -uncut)
    bc, ca = np.roll(cut_at, -uncut)[1:]
    tip = (bc, c, ca)  # and a quad of a, b, bc, ca, along its shorter diagonal
    if np.linalg.norm(places[a] - places[bc]) <= np.linalg.norm(places[b] - places[ca]):
        return np.array([tip, (a, b, bc), (a, bc, ca)])
    return np.array([tip, (a, b, ca), (b, bc, ca)])
