"""Selection of evenly spread directions from a given set."""

from __future__ import annotations

import numpy as np

# Decimals of distances between unit vectors, so that rounding differences between processors do not change the result
_DIGITS = 5


def evenly_spread(directions: np.ndarray, count: int) -> np.ndarray:
    """Return the sorted indices of ``count`` of the unit vectors ``(N, 3)``; the first vector is always kept.

    Of the closest remaining pair, the vector with the closer next neighbour is removed, until ``count`` are left. Memory: ``12
    N N`` bytes.
    """
    left = np.ones(len(directions), dtype=bool)
    apart = _distances(directions)
    nearest = apart.argmin(axis=1)
    for _ in range(len(directions) - count):
        shortest = np.where(left, apart[np.arange(len(apart)), nearest], np.inf)
        one = int(shortest.argmin())
        other = int(nearest[one])
        gone = max(one, other) if 0 in (one, other) else _more_crowded(apart, one, other)
        left[gone] = False
        apart[gone], apart[:, gone] = np.inf, np.inf
        moved = np.flatnonzero(nearest == gone)
        nearest[moved] = apart[moved].argmin(axis=1)
    return np.flatnonzero(left)


def _distances(directions: np.ndarray) -> np.ndarray:
    apart = directions @ directions.T
    np.clip(apart, -1.0, 1.0, out=apart)
    np.sqrt(np.subtract(2.0, np.multiply(2.0, apart, out=apart), out=apart), out=apart)
    rounded = np.round(apart, _DIGITS, out=apart).astype(np.float32)
    np.fill_diagonal(rounded, np.inf)
    return rounded


def _more_crowded(apart: np.ndarray, one: int, other: int) -> int:
    next_of_one = np.delete(apart[one], other).min()
    next_of_other = np.delete(apart[other], one).min()
    return one if next_of_one < next_of_other else other
