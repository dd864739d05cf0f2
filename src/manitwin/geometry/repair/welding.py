"""Vertex welding by position, and detection of degenerate and duplicate faces."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from manitwin.geometry.repair.halfedges import edge_keys, group_edges, halfedge_vertices, label_components

_STEPS = (0.1, 0.3, 1.0)  # fractions of the tolerance; the smallest step with the fewest open edges is used


def weld_equal(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Merge vertices ``(V, 3)`` at exactly equal positions, which removes texture and normal seams.

    Returns vertices in order of first appearance, and faces ``(F, 3)`` in unchanged order and number.
    """
    order = np.lexsort(vertices.T)
    ordered = vertices[order]
    first = np.ones(len(order), dtype=bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    if first.all():
        return vertices, faces
    labels = np.empty(len(order), dtype=np.int64)
    labels[order] = np.cumsum(first) - 1
    _, at, labels = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(at), dtype=np.int64)
    rank[np.argsort(at)] = np.arange(len(at))
    return vertices[np.sort(at)], rank[labels][faces]


def weld_near(vertices: np.ndarray, faces: np.ndarray, tolerance_m: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Merge vertices of open edges within a tolerance of each other; closed regions are unchanged.

    Vertices linked by a chain of near neighbours are replaced by their mean. The smallest of a few steps up to ``tolerance_m``
    with the fewest open edges is used, to preserve finer detail. Returns vertices, faces ``(F, 3)`` (same order; some may be
    degenerate) and the step used in m (0.0: no improvement).
    """
    fewest, best, used_m = _open_edges(faces, len(vertices)), (vertices, faces), 0.0
    if not fewest:
        return vertices, faces, 0.0
    start, end = halfedge_vertices(faces)
    is_open = group_edges(faces, len(vertices)).uses == 1
    loose = np.unique(np.concatenate((start[is_open], end[is_open])))
    tree = cKDTree(vertices[loose])
    for step in _STEPS:
        links = loose[tree.query_pairs(step * tolerance_m, output_type="ndarray")]
        labels = label_components(len(vertices), links[:, 0], links[:, 1])
        welded = labels[faces]
        remaining = _open_edges(welded[~collapsed_faces(welded)], len(vertices))
        if remaining < fewest:
            fewest, used_m = remaining, step * tolerance_m
            best = (_mean_positions(vertices, labels), welded)
        if not remaining:
            break
    return (*best, used_m)


def collapsed_faces(faces: np.ndarray) -> np.ndarray:
    """Return which faces ``(F, 3)`` contain a vertex twice."""
    a, b, c = faces.T
    return (a == b) | (b == c) | (c == a)


def repeated_faces(faces: np.ndarray) -> np.ndarray:
    """Return which faces ``(F, 3)`` repeat the three vertices of an earlier face, in either winding."""
    triples = np.sort(faces, axis=1)
    order = np.lexsort((np.arange(len(faces)), *triples.T))
    ordered = triples[order]
    repeated = np.zeros(len(faces), dtype=bool)
    repeated[order[1:]] = (ordered[1:] == ordered[:-1]).all(axis=1)
    return repeated


def _open_edges(faces: np.ndarray, vertex_count: int) -> int:
    """Return the number of edges with one face."""
    if not len(faces):
        return 0
    keys = np.sort(edge_keys(*halfedge_vertices(faces), vertex_count))
    different = np.append(True, np.append(keys[1:] != keys[:-1], True))
    return int((different[1:] & different[:-1]).sum())


def _mean_positions(vertices: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Return the mean position per label."""
    counts = np.bincount(labels)
    sums = np.stack([np.bincount(labels, weights=column) for column in vertices.T], axis=1)
    merged = sums / counts[:, None]
    alone = counts[labels] == 1
    merged[labels[alone]] = vertices[alone]
    return merged
