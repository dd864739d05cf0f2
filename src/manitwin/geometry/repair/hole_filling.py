"""Hole filling with triangulations of least area and bending, after Liepa 2003, "Filling holes in meshes"."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from manitwin.geometry.repair.halfedges import (
    corner_fans,
    edge_keys,
    group_edges,
    halfedge_vertices,
    next_halfedge,
    twins_of_manifold_edges,
)
from manitwin.geometry.repair.surface import NEW, Surface, face_normals

_LARGEST_EXACT_LOOP = 120  # edges; the dynamic programme is O(n^3), so longer loops are first divided
_BENDING_WEIGHT = 0.25  # weight of an edge's squared length times 1 - cos of its dihedral angle, relative to area

_SAME_FAN_PENALTY = 4.0  # exceeds any 1 - cosine, to prefer crossing the gap between two fans at a vertex


@dataclass(frozen=True)
class FilledSurface:
    """A surface with its holes closed; ``loop_of_face (F,)`` is the index of the loop that a face fills, or -1."""

    surface: Surface
    loop_of_face: np.ndarray


def fill_loops(surface: Surface, loops: list[np.ndarray]) -> FilledSurface:
    """Close simple boundary loops (see ``boundary_loops``) with new faces, glued to the rim and to each other.

    A loop of two half-edges is zipped. Diagonals that are already edges of the surface are not used; if no such triangulation
    exists, a fan around the loop's mean point closes the hole.
    """
    start, end = halfedge_vertices(surface.faces)
    existing = np.unique(edge_keys(start, end, len(surface.vertices)))
    normals = face_normals(surface.vertices, surface.faces)
    corners: list[np.ndarray] = []  # the vertex of every polygon corner of all patches
    patches: list[np.ndarray] = []
    patch_loops: list[np.ndarray] = []
    centers: list[np.ndarray] = []
    corner_count, twin = 0, surface.twin.copy()
    for number, loop in enumerate(loops):
        if len(loop) == 2:
            twin[loop[0]], twin[loop[1]] = loop[1], loop[0]
            continue
        polygon = start[loop]
        taken = _diagonals_taken(polygon, existing, len(surface.vertices))
        triangles = _triangulate(surface.vertices[polygon], normals[loop // 3], taken)
        if triangles is None:
            polygon = np.append(polygon, len(surface.vertices) + len(centers))
            centers.append(surface.vertices[start[loop]].mean(0))
            triangles = np.stack(
                [np.roll(np.arange(len(loop)), -1), np.arange(len(loop)), np.full(len(loop), len(loop))], 1
            )
        corners.append(polygon)
        patches.append(triangles + corner_count)
        patch_loops.append(np.full(len(triangles), number))
        corner_count += len(polygon)
    zipped = replace(surface, twin=twin)
    if not patches:
        return FilledSurface(zipped, np.full(len(surface.faces), -1))
    filled = _attach(zipped, np.concatenate(corners), np.concatenate(patches), np.array(centers).reshape(-1, 3))
    return FilledSurface(filled, np.concatenate((np.full(len(surface.faces), -1), *patch_loops)))


def _attach(surface: Surface, corners: np.ndarray, patch: np.ndarray, centers: np.ndarray) -> Surface:
    """Append patch faces, given as indices into polygon ``corners``, and glue them to the rims."""
    patch_twin = twins_of_manifold_edges(group_edges(patch, len(corners)))
    old = len(surface.faces)
    joined = Surface(
        np.concatenate((surface.vertices, centers)),
        np.concatenate((surface.faces, corners[patch])),
        np.concatenate((surface.source, np.full(len(patch), NEW))),
        np.concatenate((surface.flipped, np.zeros(len(patch), dtype=bool))),
        np.concatenate((surface.twin, np.where(patch_twin >= 0, patch_twin + 3 * old, -1))),
    )
    start, end = halfedge_vertices(joined.faces)
    count = len(joined.vertices)
    boundary = joined.boundary
    rims, patch_rims = boundary[boundary < 3 * old], boundary[boundary >= 3 * old]
    rims = rims[np.argsort(start[rims].astype(np.int64) * count + end[rims], kind="stable")]
    patch_rims = patch_rims[np.argsort(end[patch_rims].astype(np.int64) * count + start[patch_rims], kind="stable")]
    twin = joined.twin.copy()
    twin[rims], twin[patch_rims] = patch_rims, rims
    return replace(joined, twin=twin)


def _diagonals_taken(polygon: np.ndarray, existing: np.ndarray, vertex_count: int) -> np.ndarray:
    """Return which pairs of polygon corners ``(n, n)`` are already joined by an edge of the surface."""
    keys = edge_keys(polygon[:, None], polygon[None], vertex_count)
    at = np.minimum(np.searchsorted(existing, keys), len(existing) - 1)
    return existing[at] == keys


def _triangulate(points: np.ndarray, rim_normals: np.ndarray, taken: np.ndarray) -> np.ndarray | None:
    """Triangulate a loop of points ``(n, 3)``; return corner triples ``(n - 2, 3)`` wound against the loop, or None.

    ``rim_normals (n, 3)`` are the normals of the faces outside the edges i -> i + 1.
    """
    count = len(points)
    if count == 3:
        return np.array([[2, 1, 0]])
    if count <= _LARGEST_EXACT_LOOP:
        return _least_weight_triangulation(points, rim_normals, taken)
    diagonal = _cutting_diagonal(points, taken)
    if diagonal is None:
        return None
    i, j = diagonal
    inner, outer = np.arange(i, j + 1), np.append(np.arange(j, count), np.arange(i + 1))
    across = _plane_normal(points)
    result = []
    for part in (inner, outer):
        part_normals = np.append(rim_normals[part[:-1]], across[None], axis=0)
        triangles = _triangulate(points[part], part_normals, taken[np.ix_(part, part)])
        if triangles is None:
            return None
        result.append(part[triangles])
    return np.concatenate(result)


def _plane_normal(points: np.ndarray) -> np.ndarray:
    """Return the unit normal of a patch that closes a loop traversed with the surface on its left (Newell's method)."""
    normal = np.cross(points, np.roll(points, -1, axis=0)).sum(0)
    return -normal / max(float(np.linalg.norm(normal)), np.finfo(float).tiny)


def _cutting_diagonal(points: np.ndarray, taken: np.ndarray) -> tuple[int, int] | None:
    """Return the diagonal that is shortest relative to the rim length it cuts off, with at least a quarter in each part."""
    count = len(points)
    steps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    along = np.append(0.0, np.cumsum(steps))
    i, j = np.triu_indices(count, k=count // 4)
    wide = (j - i <= count - count // 4) & ~taken[i, j]
    i, j = i[wide], j[wide]
    if not len(i):
        return None
    rim = np.abs(along[j] - along[i])
    rim = np.minimum(rim, along[-1] - rim)
    score = np.linalg.norm(points[i] - points[j], axis=1) / np.maximum(rim, np.finfo(float).tiny)
    best = int(score.argmin())
    return int(i[best]), int(j[best])


def _least_weight_triangulation(points: np.ndarray, rim_normals: np.ndarray, taken: np.ndarray) -> np.ndarray | None:
    """Run the dynamic programme of Liepa 2003, section 2, for all sub-polygons of one size at a time.

    The weight is area plus bending over all inner edges and the rim. Returns None if every triangulation needs a taken
    diagonal.
    """
    count = len(points)
    scale = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1).mean()
    points = (points - points.mean(0)) / max(float(scale), np.finfo(float).tiny)
    weight = np.full((count, count), np.inf)
    apex = np.zeros((count, count), dtype=np.int64)
    normal = np.zeros((count, count, 3))  # of the triangle on the diagonal i, j inside sub-polygon i..j
    rim = np.arange(count - 1)
    weight[rim, rim + 1] = 0.0
    normal[rim, rim + 1] = rim_normals[:-1]
    squared = ((points[:, None] - points[None]) ** 2).sum(-1)
    for gap in range(2, count):
        i = np.arange(count - gap)[:, None]
        j, middle = i + gap, i + np.arange(1, gap)[None]
        cross = np.cross(points[j] - points[i], points[middle] - points[i])  # wound i, j, m: against the loop
        doubled = np.linalg.norm(cross, axis=-1)
        unit = cross / np.maximum(doubled, np.finfo(float).tiny)[..., None]
        bend_left = 1 - np.einsum("abk,abk->ab", unit, normal[i, middle])
        bend_right = 1 - np.einsum("abk,abk->ab", unit, normal[middle, j])
        cost = weight[i, middle] + weight[middle, j] + 0.5 * doubled
        cost += _BENDING_WEIGHT * (bend_left * squared[i, middle] + bend_right * squared[middle, j])
        if gap == count - 1:
            cost += _BENDING_WEIGHT * (1 - unit @ rim_normals[-1]) * squared[0, -1]
        best = cost.argmin(1)
        rows = np.arange(count - gap)
        free = ~taken[rows, rows + gap] if gap < count - 1 else np.ones(1, dtype=bool)
        weight[rows, rows + gap] = np.where(free, cost[rows, best], np.inf)
        apex[rows, rows + gap] = rows + 1 + best
        normal[rows, rows + gap] = unit[rows, best]
    if not np.isfinite(weight[0, -1]):
        return None
    return _collect(apex, count)


def _collect(apex: np.ndarray, count: int) -> np.ndarray:
    """Reconstruct the triangles from the table of best apexes."""
    triangles = []
    open_spans = [(0, count - 1)]
    while open_spans:
        i, j = open_spans.pop()
        if j - i < 2:
            continue
        middle = int(apex[i, j])
        triangles.append((i, j, middle))
        open_spans += [(i, middle), (middle, j)]
    return np.array(triangles)


def boundary_loops(surface: Surface) -> list[np.ndarray]:
    """Return the simple loops of boundary half-edges of a consistently wound surface, in traversal order.

    The end of each half-edge is the start of the next. No vertex occurs twice in a loop: where rims touch at a vertex, each is
    continued across the gap that it borders, and a loop that still meets itself is divided there.
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
    """Map every boundary half-edge to its successor along the same rim."""
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
    """Divide a closed walk of half-edges wherever it returns to a vertex."""
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
