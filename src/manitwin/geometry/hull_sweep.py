"""Times of impact of translating convex hulls, for many pairs at once.

Source: van den Bergen 2004, "Ray casting against general convex objects with application to continuous collision detection": a
ray from the origin against the Minkowski difference, clipped at each supporting plane that separates it.
"""

from __future__ import annotations

import numpy as np

from manitwin.geometry.hull_distance import nearest_on_simplex, support

TOLERANCE_M = 1e-4
MAX_ITERATIONS = 64
_PARALLEL = 1e-12


def first_contacts(
    moving: np.ndarray, others: np.ndarray, directions: np.ndarray, length_m: float, within_m: float = 0.0
) -> np.ndarray:
    """Return the distance (m) each hull translates until it is within ``within_m`` of its counterpart; infinite beyond
    ``length_m``.

    ``moving (P, A, 3)`` and ``others (P, B, 3)`` are the vertices of each pair, ``directions (P, 3)`` unit vectors. Pairs
    within ``within_m`` at the start return 0. The error is about ``TOLERANCE_M``, and distances are never overestimated.
    """
    pairs = len(moving)
    result = np.full(pairs, np.inf)
    along = np.zeros(pairs)
    # a vertex, not the mean, as hulls in a batch may be padded with copies
    corners = np.repeat((others[:, 0] - moving[:, 0])[:, None], 4, axis=1)
    apart = -corners[:, 0]  # from the nearest known point of the Minkowski difference to the current point of the ray
    active = np.arange(pairs)
    for _ in range(MAX_ITERATIONS):
        if not len(active):
            break
        length = np.maximum(np.linalg.norm(apart, axis=1, keepdims=True), _PARALLEL)
        farthest = support(others[active], moving[active], apart) + within_m * apart / length
        beyond = np.einsum("pi,pi->p", apart, along[active, None] * directions[active] - farthest)
        slope = np.einsum("pi,pi->p", apart, directions[active])
        separated = beyond > 0
        gone = separated & (slope >= -_PARALLEL)
        along[active] += np.where(separated & ~gone, -beyond / np.where(slope < 0, slope, -1.0), 0.0)
        gone |= along[active] > length_m
        corners = _with(corners, farthest)
        apart, used, inside = nearest_on_simplex((along[active, None] * directions[active])[:, None] - corners)
        met = ~gone & (inside | (np.linalg.norm(apart, axis=1) < TOLERANCE_M))
        result[active[met]] = along[active[met]]
        going = ~(met | gone)
        kept = corners[np.arange(len(corners)), used.argmax(1)]
        corners = np.where(used[..., None], corners, kept[:, None])[going]
        active, apart = active[going], apart[going]
    result[active] = along[active]
    return result


def least_contacts(
    moving: np.ndarray,
    others: np.ndarray,
    directions: np.ndarray,
    groups: np.ndarray,
    at_least_m: np.ndarray,
    length_m: float,
    within_m: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the minimum of ``first_contacts`` per group ``(G,)``, and lower bounds per pair ``(P,)``, raised where computed.

    ``groups (P,)`` are group indices from 0 to G - 1, ``at_least_m (P,)`` lower bounds of each pair's distance. The most
    promising pair of each group is computed first; pairs whose bound is not below the group's current minimum are skipped.
    """
    least = np.full(int(groups.max()) + 1, np.inf)
    bounds = at_least_m.copy()
    order = np.lexsort((at_least_m, groups))
    first = order[np.unique(groups[order], return_index=True)[1]]
    open_pairs = np.ones(len(groups), dtype=bool)
    for asked in (first, order):
        chosen = asked[open_pairs[asked] & (bounds[asked] < least[groups[asked]])]
        found = first_contacts(moving[chosen], others[chosen], directions[chosen], length_m, within_m)
        np.minimum.at(least, groups[chosen], found)
        bounds[chosen] = found
        open_pairs[chosen] = False
    return least, bounds


def _with(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Insert a point into each simplex ``(P, 4, 3)`` in place of a duplicate corner."""
    same = (corners[:, :, None] == corners[:, None]).all(-1) & ~np.eye(4, dtype=bool)
    place = np.where(same.any((1, 2)), same.any(2).argmax(1), 3)
    result = corners.copy()
    result[np.arange(len(corners)), place] = points
    return result
