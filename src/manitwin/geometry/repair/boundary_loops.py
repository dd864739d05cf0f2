"""The rims of holes as simple loops of boundary half-edges."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from manitwin.geometry.repair.halfedges import corner_fans, halfedge_vertices, next_halfedge
from manitwin.geometry.repair.surface import Surface

_SAME_FAN_PENALTY = 4.0  # more than any 1 - cosine: prefer to cross the gap between two fans that meet at a vertex


def boundary_loops(surface: Surface) -> list[np.ndarray]:
    """Return the simple loops of boundary half-edges of a consistently wound surface, in walking order.

    The end of each half-edge is the start of the next. No vertex occurs twice in a loop: where rims touch at a vertex,
    each is continued across the gap that it borders, and a loop that still meets itself is cut in two there.
    """
    boundary = surface.boundary
    if not len(boundary):
        return []
    start, end = halfedge_vertices(surface.faces)
    following = _following(surface, boundary, start, end)
    loops: list[np.ndarray] = []
    seen: set[int] = set()
    for first in boundary.tolist():
        if first in seen:
            continue
        cycle = [first]
        while (successor := following[cycle[-1]]) != first:
            cycle.append(successor)
        seen.update(cycle)
        loops.extend(_simple_loops(cycle, start))
    return loops


def loop_lengths(surface: Surface, loops: list[np.ndarray]) -> np.ndarray:
    """Return the length ``(L,)`` of every loop."""
    start, end = halfedge_vertices(surface.faces)
    return np.array(
        [np.linalg.norm(surface.vertices[end[loop]] - surface.vertices[start[loop]], axis=1).sum() for loop in loops]
    )


def _following(surface: Surface, boundary: np.ndarray, start: np.ndarray, end: np.ndarray) -> dict[int, int]:
    """Match every boundary half-edge with the one that goes on along the same rim."""
    order_out, order_in = (
        boundary[np.argsort(start[boundary], kind="stable")],
        boundary[np.argsort(end[boundary], kind="stable")],
    )
    following = dict(zip(order_in.tolist(), order_out.tolist(), strict=True))
    at = start[order_out]
    shared = np.flatnonzero(np.append(False, at[1:] == at[:-1]))
    if not len(shared):
        return following
    fans = corner_fans(surface.twin)
    for vertex in np.unique(at[shared]):
        here = slice(*np.searchsorted(at, [vertex, vertex + 1]))
        arriving, leaving = order_in[here], order_out[here]
        back = surface.vertices[start[arriving]] - surface.vertices[vertex]
        on = surface.vertices[end[leaving]] - surface.vertices[vertex]
        back /= np.maximum(np.linalg.norm(back, axis=1, keepdims=True), np.finfo(float).tiny)
        on /= np.maximum(np.linalg.norm(on, axis=1, keepdims=True), np.finfo(float).tiny)
        same_fan = fans[next_halfedge(arriving)][:, None] == fans[leaving][None]
        rows, columns = linear_sum_assignment(1 - back @ on.T + _SAME_FAN_PENALTY * same_fan)
        following.update(zip(arriving[rows].tolist(), leaving[columns].tolist(), strict=True))
    return following


def _simple_loops(cycle: list[int], start: np.ndarray) -> list[np.ndarray]:
    """Cut a closed walk of half-edges wherever it comes back to a vertex."""
    loops = []
    path: list[int] = []
    position: dict[int, int] = {}
    for halfedge in [*cycle, cycle[0]]:
        vertex = int(start[halfedge])
        if vertex in position:
            loop = path[position[vertex] :]
            del path[position[vertex] :]
            loops.append(np.array(loop))
            for member in loop:
                del position[int(start[member])]
        position[vertex] = len(path)
        path.append(halfedge)
    return loops
