"""The stem of a round object: a protrusion on one side of a fruit, in any pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_ROUNDS = 4
_SMOOTH = 1.06  # fraction of the smooth body's radius; samples beyond are not used for the fit
_STICKS_OUT = 0.10  # fraction of the smooth body's radius, beyond it
_LEAST_SAMPLES, _MOST_SHARE = 4, 0.25  # the neck of a pear counts as a stem
_SPREAD_RAD = np.radians(50)  # about the farthest sample
_RIVAL = 0.7  # fraction of the farthest excess: a similar one elsewhere rules out a stem, but roots opposite may stick out less
_LEAST_EXTENTS = 0.5  # ratio of the shortest to the longest box side; more elongated objects are not round


@dataclass(frozen=True)
class Stem:
    """The unit ``direction`` from the body's ``center_m`` to the stem, and the distance from there to its end (m)."""

    center_m: np.ndarray
    direction: np.ndarray
    reach_m: float


def find_stem(surface_m: np.ndarray, extents_m: np.ndarray) -> Stem | None:
    """Find the stem of a round object from its surface samples ``(N, 3)``; None if it is not round or has no stem.

    The body's radius by direction is a sum of spherical harmonics up to second order, fitted to the samples that do not stick
    out.
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
