"""Half-edges of triangle meshes and their twins.

Half-edge ``3 * f + k`` runs from corner ``k`` of face ``f`` to corner ``(k + 1) % 3``. An array ``twin (3F,)`` holds the
half-edge glued to each, or -1 at a boundary. Gluing is independent of vertex indices: two sheets may touch along the same two
vertices without being one surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

BOUNDARY = -1


def halfedge_vertices(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the start and end vertex ``(3F,)`` of every half-edge of faces ``(F, 3)``."""
    return faces.ravel(), np.roll(faces, -1, axis=1).ravel()


def next_halfedge(halfedges: np.ndarray) -> np.ndarray:
    """Return the following half-edges in the same faces."""
    return halfedges - halfedges % 3 + (halfedges + 1) % 3


def previous_halfedge(halfedges: np.ndarray) -> np.ndarray:
    """Return the preceding half-edges in the same faces."""
    return halfedges - halfedges % 3 + (halfedges + 2) % 3


@dataclass(frozen=True)
class EdgeGroups:
    """Half-edges grouped by undirected edge.

    Group ``g`` is ``order[starts[g] : starts[g] + counts[g]]``; ``group_of (3F,)`` is the inverse.
    """

    order: np.ndarray
    starts: np.ndarray
    counts: np.ndarray
    group_of: np.ndarray

    @property
    def uses(self) -> np.ndarray:
        """The number of faces at the edge of each half-edge ``(3F,)``."""
        return self.counts[self.group_of]

    def members(self, group: int) -> np.ndarray:
        """Return the half-edges of one group."""
        return self.order[self.starts[group] : self.starts[group] + self.counts[group]]


def edge_keys(start: np.ndarray, end: np.ndarray, vertex_count: int) -> np.ndarray:
    """Return a unique int64 key per undirected edge."""
    return np.minimum(start, end).astype(np.int64) * vertex_count + np.maximum(start, end)


def group_edges(faces: np.ndarray, vertex_count: int) -> EdgeGroups:
    """Group the half-edges of faces ``(F, 3)`` by undirected edge."""
    keys = edge_keys(*halfedge_vertices(faces), vertex_count)
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    first = np.ones(len(ordered), dtype=bool)
    first[1:] = ordered[1:] != ordered[:-1]
    starts = np.flatnonzero(first)
    group_of = np.empty(len(keys), dtype=np.int64)
    group_of[order] = np.cumsum(first) - 1
    return EdgeGroups(order, starts, np.diff(np.append(starts, len(keys))), group_of)


def twins_of_manifold_edges(groups: EdgeGroups) -> np.ndarray:
    """Glue the half-edges of every edge that has exactly two; all others are boundary. Returns ``twin (3F,)``."""
    twin = np.full(len(groups.order), BOUNDARY, dtype=np.int64)
    pairs = groups.starts[groups.counts == 2]
    a, b = groups.order[pairs], groups.order[pairs + 1]
    twin[a], twin[b] = b, a
    return twin


def is_closed_and_consistent(faces: np.ndarray, vertex_count: int) -> bool:
    """Return whether every edge has exactly two faces that traverse it in opposite directions."""
    if len(faces) < 4 or len(faces) % 2:
        return False
    start, end = halfedge_vertices(faces)
    forward = np.sort(start.astype(np.int64) * vertex_count + end)
    if (forward[1:] == forward[:-1]).any():
        return False
    backward = np.sort(end.astype(np.int64) * vertex_count + start)
    return bool((start != end).all() and np.array_equal(forward, backward))


def label_components(count: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Label the connected components of ``count`` nodes with links ``a[i] - b[i]``, numbered by their first nodes."""
    _, labels = connected_components(
        coo_matrix((np.ones(len(a), dtype=bool), (a, b)), shape=(count, count)), directed=False
    )
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[inverse]


def face_components(twin: np.ndarray) -> np.ndarray:
    """Return the component label ``(F,)`` of every face, connected across glued half-edges."""
    glued = np.flatnonzero(twin >= 0)
    return label_components(len(twin) // 3, glued // 3, twin[glued] // 3)


def corner_fans(twin: np.ndarray) -> np.ndarray:
    """Return the fan label ``(3F,)`` of every corner: corners of one fan are connected around a vertex through glued edges.

    A surface is manifold at a vertex if all its corners form one fan. Requires consistent winding: the start of a half-edge is
    the end of its twin.
    """
    glued = np.flatnonzero(twin >= 0)
    return label_components(len(twin), glued, next_halfedge(twin[glued]))


def split_vertices(vertices: np.ndarray, faces: np.ndarray, twin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Give every fan of corners its own vertex, and drop unused vertices.

    Returns vertices and faces ``(F, 3)``. Vertices keep the input order, with copies right after their originals (Gueziec et
    al. 2001, "Cutting and stitching", section 4: local cutting).
    """
    fans = corner_fans(twin)
    corner_vertex = faces.ravel()
    _, first, inverse = np.unique(fans, return_index=True, return_inverse=True)
    order = np.lexsort((np.arange(len(first)), corner_vertex[first]))
    rank = np.empty(len(first), dtype=np.int64)
    rank[order] = np.arange(len(first))
    return vertices[corner_vertex[first[order]]], rank[inverse].reshape(-1, 3)
