"""Which hulls of an object a closing hand can reach: the others cost time in every step and touch nothing."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from manitwin.robots.grippers.parallel import ParallelGripper


class HandReach:
    """The hulls of an object, prepared to be told how far they are from many hands."""

    def __init__(self, hulls: tuple[np.ndarray, ...]):
        """Take convex vertices, each ``(V, 3)`` m in the object frame."""
        self._hulls, self._corners = hulls, np.concatenate(hulls)
        self._starts = np.cumsum([0] + [len(hull) for hull in hulls[:-1]])
        low, high = np.minimum.reduceat(self._corners, self._starts), np.maximum.reduceat(self._corners, self._starts)
        self._centers, self._radii_m = (low + high) / 2, np.linalg.norm(high - low, axis=1) / 2

    def of(self, some: np.ndarray) -> HandReach:
        """Return that of some of the hulls, ``(H,)`` bool."""
        return HandReach(tuple(self._hulls[index] for index in np.flatnonzero(some)))

    def gaps_m(self, gripper: ParallelGripper, object_to_gripper: np.ndarray) -> np.ndarray:
        """Return how far palm and moving fingers stay off each hull at poses ``(P, 4, 4)`` of the object: ``(P, H)``.

        Never too much: along the gripper's axes, between boxes around the hulls and boxes around what the hand sweeps as
        it closes. It is negative where these overlap.
        """
        rotations, origins = object_to_gripper[:, :3, :3].transpose(0, 2, 1), object_to_gripper[:, None, :3, 3]
        corners = self._corners @ rotations + origins
        low, high = (reduce.reduceat(corners, self._starts, axis=1)[:, :, None] for reduce in (np.minimum, np.maximum))
        swept_low, swept_high = _swept_boxes(gripper)
        return np.maximum(low - swept_high, swept_low - high).max(3).min(2)

    def motions_m(self, object_to_gripper: np.ndarray) -> np.ndarray:
        """Return bounds ``(H,)`` on how far a corner of each hull is in any of the poses ``(P, 4, 4)`` from where it is first.

        A ball around the hull moves as its centre does, and by its radius times the norm of the change of rotation:
        the largest singular value of a difference of rotations is its Frobenius norm over the root of two.
        """
        change = object_to_gripper - object_to_gripper[0]
        moved = self._centers @ change[:, :3, :3].transpose(0, 2, 1) + change[:, None, :3, 3]
        turned = np.linalg.norm(change[:, :3, :3], axis=(1, 2)) / np.sqrt(2)
        return np.asarray((np.linalg.norm(moved, axis=2) + turned[:, None] * self._radii_m).max(0))


@lru_cache(maxsize=8)
def _swept_boxes(gripper: ParallelGripper) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners ``(B, 3)`` of boxes around what each box of the hand sweeps between open and closed."""
    ends = [[_bounds(*box) for box in gripper.boxes(opening_m)] for opening_m in (gripper.opening_m, 0.0)]
    low, high = np.moveaxis(np.array(ends), 2, 0)
    return low.min(0), high.max(0)


def _bounds(box_to_gripper: np.ndarray, half_extents_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    reach = np.abs(box_to_gripper[:3, :3]) @ half_extents_m
    return box_to_gripper[:3, 3] - reach, box_to_gripper[:3, 3] + reach
