"""Where an arm is told to be between two actions: what episodes follow and what an environment's policy is followed by."""

from __future__ import annotations

import numpy as np

ORDER = 3  # of the polynomial between actions
HELD = 1e-3  # m or rad, or of 1: a hand that is told so much else than it began with holds something, or is about to


class JointTargets:
    """Where an arm is told to be within a step: on the cubic through the targets ``(n,)`` rad at the ends of the last four.

    Motions are planned at every timestep, actions are samples of them; between four samples of a smooth motion a cubic is off
    by a term of fourth order (Newton's backward differences), and so little beside its speed, which the drives' dampers follow.
    It passes through the targets, and goes beyond them by about a quarter of a jump at most.
    """

    def __init__(self, start_rad: np.ndarray, lowest_rad: np.ndarray, highest_rad: np.ndarray):
        """Begin at rest; what would be beyond the joints' limits is clipped."""
        self._last = np.repeat(np.asarray(start_rad, float)[None], ORDER, axis=0)
        self._lowest, self._highest = lowest_rad, highest_rad

    def towards(self, target_rad: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the targets ``(count, n)`` at even times until the end of the step, which is ``target_rad (n,)``, and speeds.

        Speeds ``(count, n)`` are those there, rad a step; of joints at their limits 0.
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
    """Return the polynomial through ``samples (K, n)``, a step apart, at times ``(T,)`` in steps from the last: ``(T, n)``."""
    factor, rows = np.ones((len(left), 1)), np.repeat(samples[-1:], len(left), axis=0)
    for order in range(1, len(samples)):
        factor = factor * (left[:, None] + order - 1) / order
        rows = rows + factor * np.diff(samples, n=order, axis=0)[-1]
    return rows


def hand_share(number: int, per_frame: int, count: int) -> float:
    """Return how much of its way a hand is told at timestep ``number`` (from 1) of ``count``: it is told anew once a frame."""
    return float(min(1.0, np.ceil(number / per_frame) * per_frame / count))


def may_hold(told: np.ndarray, before: np.ndarray, began: np.ndarray) -> bool:
    """Tell whether a hand is told, now or before, anything else than what it began with: ``(h,)`` each."""
    return bool((np.abs(np.array([told, before]) - began) > HELD).any())
