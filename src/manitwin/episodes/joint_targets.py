"""Interpolation of arm targets between two actions, the same for recorded episodes and for policies in an environment."""

from __future__ import annotations

import numpy as np

ORDER = 3  # order of the polynomial between actions
HELD = 1e-3  # m, rad or a share: a hand whose target differs more from its initial one holds something, or is about to


class JointTargets:
    """Arm targets within a step, on the cubic polynomial through the targets ``(n,)`` rad at the ends of the last four steps.

    Motions are planned at every time step, and actions are samples of them. Between four samples of a smooth motion, the
    cubic has a fourth-order error (Newton's backward differences), also in its speed, which the drives' dampers follow. It
    passes through the targets, and overshoots a jump by at most about a quarter of it.
    """

    def __init__(self, start_rad: np.ndarray, lowest_rad: np.ndarray, highest_rad: np.ndarray):
        """Start at rest at ``start_rad (n,)``; targets are clipped to ``lowest_rad`` and ``highest_rad (n,)``."""
        self._last = np.repeat(np.asarray(start_rad, float)[None], ORDER, axis=0)
        self._lowest, self._highest = lowest_rad, highest_rad

    def interpolate_to(self, target_rad: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return targets ``(count, n)`` rad at uniform times up to the step's end, and speeds.

        The last target is ``target_rad (n,)``. Speeds ``(count, n)`` are in rad per step, 0 for joints at their limits.
        """
        clipped_rad = np.clip(np.asarray(target_rad, float), self._lowest, self._highest)
        samples = np.concatenate([self._last, clipped_rad[None]])
        self._last = samples[1:]
        left = np.arange(1 - count, 1) / count
        rows = _polynomial(samples, left)
        speeds = count * (_polynomial(samples, left + 0.5 / count) - _polynomial(samples, left - 0.5 / count))
        clipped = np.clip(rows, self._lowest, self._highest)
        return clipped, np.where(rows == clipped, speeds, 0.0)


def _polynomial(samples: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Return the polynomial through ``samples (K, n)``, one step apart, at times ``(T,)`` in steps from the last: ``(T, n)``."""
    factor, rows = np.ones((len(left), 1)), np.repeat(samples[-1:], len(left), axis=0)
    for order in range(1, len(samples)):
        factor = factor * (left[:, None] + order - 1) / order
        rows = rows + factor * np.diff(samples, n=order, axis=0)[-1]
    return rows


def hand_share(number: int, per_frame: int, count: int) -> float:
    """Return the share of its motion that a hand's target has completed at time step ``number`` (from 1) of ``count``.

    The target is updated every ``per_frame`` time steps.
    """
    return float(min(1.0, np.ceil(number / per_frame) * per_frame / count))


def may_hold(told: np.ndarray, before: np.ndarray, began: np.ndarray) -> bool:
    """Tell whether a hand's current or previous target, ``(h,)`` each, differs from its initial one."""
    return bool((np.abs(np.array([told, before]) - began) > HELD).any())
