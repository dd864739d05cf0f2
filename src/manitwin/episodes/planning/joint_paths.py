"""Paths of joint positions: straight segments and their test, shortcuts and rounded corners."""

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
    """Joint positions over [0, 1], or their first or second derivative, as scipy's splines give them."""

    def __call__(self, places: np.ndarray, nu: int = 0) -> np.ndarray:
        """Return ``(..., n)`` for places ``(...)``."""
        ...


class JointSegment:
    """The straight line in joint space from one configuration to another."""

    def __init__(self, start: np.ndarray, end: np.ndarray):
        """Take configurations ``(n,)``."""
        self.start, self.end = start, end

    def __call__(self, places: np.ndarray, nu: int = 0) -> np.ndarray:
        """Return positions or derivatives at places."""
        places, change = np.asarray(places, float)[..., None], self.end - self.start
        if nu == 0:
            return self.start + places * change
        return np.broadcast_to(change if nu == 1 else np.zeros_like(change), (*places.shape[:-1], len(change)))


def is_segment_free(start: np.ndarray, end: np.ndarray, is_free: Callable[[np.ndarray], bool], step_rad: float) -> bool:
    """Tell whether even places no further apart than ``step_rad`` are free; ``start`` is taken to be.

    The end goes first, then the middle, then the quarters: collisions are met early.
    """
    way = end - start
    count = max(1, int(np.ceil(float(np.linalg.norm(way)) / step_rad)))
    return all(is_free(start + way * place) for place in bisection_places(count))


@lru_cache(maxsize=4096)
def bisection_places(count: int) -> tuple[float, ...]:
    """Return 1 / count, ..., 1 in the order of coarse steps before fine ones."""
    return tuple(k / count for k in sorted(range(1, count + 1), key=lambda k: (k < count, -(k & -k), k)))


def shortcut(
    waypoints: np.ndarray,
    is_free: Callable[[np.ndarray], bool],
    rng: np.random.Generator,
    *,
    tries: int,
    check_step_rad: float,
) -> np.ndarray:
    """Replace parts of a path ``(N, n)`` by straight lines between two random places of it, where these are free."""
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
    """Return the path resampled evenly, its corners rounded over about ``radius_rad`` to either side.

    Three passes of a moving average, mirrored through the ends so that these stay. A spline through corners that were cut at
    uneven places nearly stalls when it is timed; through even ones it does not.
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
    """Return the length of the path up to each waypoint."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(waypoints, axis=0), axis=1))])
