"""Cutting of mesh faces along the border of a region, with neighbouring faces split so that the mesh stays closed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

STEPS = 40
"""Bisection steps for the crossing of an edge: accurate to 1e-12 of its length."""
SNAP = 0.005
"""Fraction of an edge: a crossing this close to an end is snapped to it, which avoids slivers."""


def cut_along_border(
    vertices: np.ndarray, faces: np.ndarray, chosen: np.ndarray, where: Callable[[np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Cut the chosen faces along the border of a spatial region; return vertices, faces, the original face of each, and
    membership.

    ``vertices (V, 3)``, ``faces (F, 3)``, ``chosen (F,) bool``; ``where`` maps positions ``(N, 3)`` to ``(N,) bool``. New
    vertices lie on edges, which are also split in adjacent faces, so that the surface keeps its shape and stays closed. The
    border is straight within a face. A face that is not cut is inside if its centre is; faces that were not chosen are never
    inside.
    """
    within = where(vertices)
    edges, of_edge = np.unique(
        np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_inverse=True
    )
    of_edge = of_edge.reshape(-1, 3)  # the edge from each corner of a face to the next
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
    signs = side[result].sum(axis=1)  # all corners of a piece are on one side of the border or on it
    inside = np.where(whole[origin] | (signs == 0), where(places[result].mean(axis=1)), signs > 0)
    return places, result, origin, inside & chosen[origin]


def _crossings(
    starts: np.ndarray, ends: np.ndarray, within: np.ndarray, where: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Return the shares ``(N,)`` at which a border crosses the edges from ``(N, 3)`` to ``(N, 3)``, by bisection."""
    low, high = np.zeros(len(starts)), np.ones(len(starts))
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        same = where(starts + middle[:, None] * (ends - starts)) == within
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return 0.5 * (low + high)


def _pieces(corners: np.ndarray, cut_at: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Split a triangle at vertices ``cut_at (3,)`` on its edges (that after each corner; -1: none) into triangles ``(K, 3)``."""
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
    tip = (bc, c, ca)  # plus the quad a, b, bc, ca, split along its shorter diagonal
    if np.linalg.norm(places[a] - places[bc]) <= np.linalg.norm(places[b] - places[ca]):
        return np.array([tip, (a, b, bc), (a, bc, ca)])
    return np.array([tip, (a, b, ca), (b, bc, ca)])
