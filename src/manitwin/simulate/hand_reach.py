"""Which hulls of an object a closing hand can reach: the others cost time in every step and touch nothing."""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np

from manitwin.geometry.poses import inverse
from manitwin.simulate.hands.parallel import ParallelGripper


def reachable_hulls(
    hulls: tuple[np.ndarray, ...], gripper: ParallelGripper, gripper_to_object: np.ndarray, margin_m: float
) -> np.ndarray:
    """Tell for each hull ``(V, 3)`` whether palm or moving fingers can come within ``margin_m`` of it, ``(H,)`` bool.

    Never too few: boxes around the hulls, in the gripper's frame, against boxes around what the hand sweeps as it
    closes.
    """
    return reached_at(hulls, gripper, inverse(gripper_to_object)[None], margin_m)[0]


def reached_at(
    hulls: tuple[np.ndarray, ...], gripper: ParallelGripper, object_to_gripper: np.ndarray, margin_m: float
) -> np.ndarray:
    """Tell the same of several poses of the object ``(P, 4, 4)`` in the gripper's frame, ``(P, H)`` bool."""
    starts = np.cumsum([0] + [len(hull) for hull in hulls[:-1]])
    corners = (
        np.concatenate(hulls) @ object_to_gripper[:, :3, :3].transpose(0, 2, 1) + object_to_gripper[:, None, :3, 3]
    )
    low, high = np.minimum.reduceat(corners, starts, axis=1), np.maximum.reduceat(corners, starts, axis=1)
    reached = np.zeros(low.shape[:2], bool)
    for swept_low, swept_high in _swept_boxes(gripper):
        reached |= ((low <= swept_high + margin_m) & (high >= swept_low - margin_m)).all(2)
    return reached


def largest_motion_m(hulls: tuple[np.ndarray, ...], object_to_gripper: np.ndarray) -> float:
    """Return a bound on how far any corner of the hulls strays from where it is in the first of the poses ``(P, 4, 4)``.

    The motion is affine in the point, so that its norm is largest at a corner of the box around all hulls.
    """
    points = np.concatenate(hulls)
    corners = np.array(list(product(*zip(points.min(0), points.max(0), strict=True))))
    moved = object_to_gripper[1:] - object_to_gripper[0]
    motion = corners @ moved[:, :3, :3].transpose(0, 2, 1) + moved[:, None, :3, 3]
    return float(np.sqrt((motion**2).sum(2).max(initial=0.0)))


@lru_cache(maxsize=8)
def _swept_boxes(gripper: ParallelGripper) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the corners of boxes around what each box of the hand sweeps between open and closed."""
    boxes = []
    for start, end in zip(gripper.boxes(gripper.opening_m), gripper.boxes(0.0), strict=True):
        (first_low, first_high), (last_low, last_high) = _bounds(*start), _bounds(*end)
        boxes.append((np.minimum(first_low, last_low), np.maximum(first_high, last_high)))
    return boxes


def _bounds(box_to_gripper: np.ndarray, half_extents_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    reach = np.abs(box_to_gripper[:3, :3]) @ half_extents_m
    return box_to_gripper[:3, 3] - reach, box_to_gripper[:3, 3] + reach
