"""Part a picture in two along its edges, by a minimum cut."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

STEEPNESS = 5.0  # an edge as strong as ``edge`` costs exp(-5) of what flat ground costs
FLAT_COST = 10_000  # capacities are whole numbers


def cut_along_edges(outside: np.ndarray, inside: np.ndarray, gradient: np.ndarray, edge: float) -> np.ndarray:
    """Return what ``outside`` gets of the pixels (H, W) that are neither, when both are parted where it costs least.

    A cut between two pixels costs exp(-5 g / edge) of their gradient g (Boykov and Jolly 2001, without colours), so it runs
    along the edges that are strongest on the whole, and a weak spot in one does not let the other side through.
    """
    free = ~outside & ~inside
    node = np.where(outside, 0, 1)
    node[free] = 2 + np.arange(int(free.sum()))
    ends, costs = [], []
    for first, second in (((slice(None, -1),), (slice(1, None),)), (np.s_[:, :-1], np.s_[:, 1:])):
        a, b = node[first], node[second]
        used = (a != b) & (np.maximum(a, b) > 1)
        steepest = np.maximum(gradient[first], gradient[second])[used]
        ends.append(np.stack([a[used], b[used]]))
        costs.append(1 + FLAT_COST * np.exp(-STEEPNESS * steepest / edge))
    pairs, cost = np.concatenate(ends, axis=1), np.round(np.concatenate(costs))
    both = np.concatenate([pairs, pairs[::-1]], axis=1)
    size = 2 + int(free.sum())
    # entries of one pair add up: a pixel may touch a terminal on several sides
    graph = coo_matrix((np.concatenate([cost, cost]), both), shape=(size, size)).tocsr().astype(np.int32)
    left = graph - maximum_flow(graph, 0, 1).flow
    left.eliminate_zeros()
    reached = np.zeros(size, bool)
    reached[breadth_first_order(left, 0, return_predecessors=False)] = True
    return np.asarray(reached[node] & free)
