"""The stem of a round thing: what sticks out of a fruit on one side, wherever that side is as it lies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_ROUNDS = 4
_SMOOTH = 1.06  # of the smooth body's radius: beyond, a sample is none of the body's
_STICKS_OUT = 0.10  # of the smooth body's radius, beyond it
_LEAST_SAMPLES, _MOST_SHARE = 4, 0.25  # a pear's neck is a stem, too
_SPREAD_RAD = np.radians(50)  # about the sample that sticks out the farthest
_RIVAL = 0.7  # of what that one does: as much elsewhere makes it no stem, but roots opposite may stick out less
_LEAST_EXTENTS = 0.5  # shortest to longest side of the box: what is longer is no round thing


@dataclass(frozen=True)
class Stem:
    """The unit ``direction`` from the body's ``center_m`` to where the stem is, and how far from there it ends (m)."""

    center_m: np.ndarray
    direction: np.ndarray
    reach_m: float


def find_stem(surface_m: np.ndarray, extents_m: np.ndarray) -> Stem | None:
    """Find the stem of a round thing by its surface samples ``(N, 3)``; None of what is not round or has nothing like it.

    The body's radius by direction is a sum of spherical harmonics up to the second order, fitted to what does not
    stick out of it.
    """
    if extents_m.min() < _LEAST_EXTENTS * extents_m.max():
        return None
    center = np.median(surface_m, axis=0)
    offset = surface_m - center
    radius = np.linalg.norm(offset, axis=1)
    directions = offset / np.maximum(radius, 1e-12)[:, None]
    basis = _harmonics(directions)
    body = np.ones(len(radius), bool)
    fit = radius
    for _ in range(_ROUNDS):
        fit = np.maximum(basis @ np.linalg.lstsq(basis[body], radius[body], rcond=None)[0], 1e-9)
        body = radius < _SMOOTH * fit
        if body.sum() < basis.shape[1]:
            return None
    excess = radius / fit - 1
    out = excess > _STICKS_OUT
    beside = directions @ directions[int(excess.argmax())] > np.cos(_SPREAD_RAD)
    if not _LEAST_SAMPLES <= (out & beside).sum() <= _MOST_SHARE * len(out):
        return None
    if (out & ~beside).any() and excess[~beside].max() > _RIVAL * excess.max():
        return None
    mean = directions[out & beside].mean(axis=0)
    direction = mean / np.linalg.norm(mean)
    return Stem(center, direction, float((offset @ direction).max()))


def _harmonics(directions: np.ndarray) -> np.ndarray:
    x, y, z = directions.T
    return np.column_stack([np.ones(len(x)), x, y, z, x * y, y * z, z * x, x * x - y * y, 3 * z * z - 1])
