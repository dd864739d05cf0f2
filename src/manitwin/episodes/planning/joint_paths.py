"""Joint-space paths: straight segments and their collision test, shortcutting, corner rounding."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Protocol

import numpy as np

RESAMPLE_RAD = 0.05
PASSES = 3
LEAST_PIECES = 8
SAME_RAD = 1e-4


class JointPath(Protocol):
    """Joint positions over [0, 1], or their first or second derivative, with the interface of scipy's splines."""

    def __call__(self, places: np.ndarray, nu: int = 0) -> np.ndarray:
        """Return ``(..., n)`` for parameters ``(...)``; ``nu`` is the order of the derivative."""
        ...


class JointSegment:
    """Straight line in joint space between two configurations."""

    def __init__(self, start: np.ndarray, end: np.ndarray):
        """Take configurations ``(n,)``."""
        self.start, self.end = start, end

    def __call__(self, places: np.ndarray, nu: int = 0) -> np.ndarray:
        """Return positions or derivatives at parameters ``places``."""
        places, change = np.asarray(places, float)[..., None], self.end - self.start
        if nu == 0:
            return self.start + places * change
        return np.broadcast_to(change if nu == 1 else np.zeros_like(change), (*places.shape[:-1], len(change)))


def is_segment_free(start: np.ndarray, end: np.ndarray, is_free: Callable[[np.ndarray], bool], step_rad: float) -> bool:
    """Tell whether uniform samples at most ``step_rad`` apart are free; ``start`` is assumed free.

    The end is tested first, then the middle, then the quarters, to detect collisions early.
    """
    way = end - start
    count = max(1, int(np.ceil(float(np.linalg.norm(way)) / step_rad)))
    return all(is_free(start + way * place) for place in bisection_places(count))


@lru_cache(maxsize=4096)
def bisection_places(count: int) -> tuple[float, ...]:
    """Return 1 / count, ..., 1 in bisection order, coarse before fine."""
    return tuple(k / count for k in sorted(range(1, count + 1), key=lambda k: (k < count, -(k & -k), k)))


def shortcut(
    waypoints: np.ndarray,
    is_free: Callable[[np.ndarray], bool],
    rng: np.random.Generator,
    *,
    tries: int,
    check_step_rad: float,
) -> np.ndarray:
    """Shorten a path ``(N, n)`` by free straight segments between pairs of random points on it."""
    path = list(waypoints)
    for _ in range(tries):
        if len(path) < 3:
            break
        lengths = path_lengths(np.array(path))
        first, second = np.sort(rng.uniform(0, lengths[-1], 2))
        i, j = (max(int(np.searchsorted(lengths, place)) - 1, 0) for place in (first, second))
        if i == j:
            continue
        a = path[i] + (path[i + 1] - path[i]) * (first - lengths[i]) / (lengths[i + 1] - lengths[i])
        b = path[j] + (path[j + 1] - path[j]) * (second - lengths[j]) / (lengths[j + 1] - lengths[j])
        if is_segment_free(a, b, is_free, check_step_rad):
            path = [*path[: i + 1], a, b, *path[j + 1 :]]
    kept = [path[0]]
    for waypoint in path[1:]:
        if np.linalg.norm(waypoint - kept[-1]) > SAME_RAD:
            kept.append(waypoint)
    return np.array(kept)


def round_corners(waypoints: np.ndarray, radius_rad: float) -> np.ndarray:
    """Return the path resampled uniformly, with corners rounded over about ``radius_rad`` to either side.

    Three passes of a moving average, mirrored at the ends to keep them fixed. A spline through unevenly spaced points nearly
    stalls when it is timed; through evenly spaced ones it does not.
    """
    lengths = path_lengths(waypoints)
    count = max(LEAST_PIECES, int(np.ceil(lengths[-1] / RESAMPLE_RAD)))
    places = np.linspace(0, lengths[-1], count + 1)
    even = np.array([np.interp(places, lengths, joint) for joint in waypoints.T]).T
    half = max(1, min(int(radius_rad / (lengths[-1] / count) / 2), count // 4))
    for _ in range(PASSES):
        mirrored = np.concatenate([2 * even[0] - even[half:0:-1], even, 2 * even[-1] - even[-2 : -half - 2 : -1]])
        sums = np.concatenate([np.zeros((1, even.shape[1])), np.cumsum(mirrored, axis=0)])
        even = (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)
    even[0], even[-1] = waypoints[0], waypoints[-1]
    return even


def path_lengths(waypoints: np.ndarray) -> np.ndarray:
    """Return the path length up to each waypoint, ``(N,)``."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(waypoints, axis=0), axis=1))])
