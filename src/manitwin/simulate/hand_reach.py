"""Which hulls of an object a closing hand can reach: the others cost time in every step and touch nothing."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.poses import transform_points
from manitwin.simulate.gripper import Gripper


def reachable_hulls(
    hulls: tuple[np.ndarray, ...], gripper: Gripper, gripper_to_object: np.ndarray, margin_m: float
) -> np.ndarray:
    """Tell for each hull ``(V, 3)`` whether palm or moving fingers can come within ``margin_m`` of it, ``(H,)`` bool.

    Never too few: boxes around the hulls, in the gripper's frame, against boxes around what the hand sweeps as it
    closes.
    """
    object_to_gripper = np.linalg.inv(gripper_to_object)
    corners = [transform_points(object_to_gripper, hull) for hull in hulls]
    low, high = np.array([c.min(0) for c in corners]), np.array([c.max(0) for c in corners])
    reached = np.zeros(len(hulls), bool)
    for start, end in zip(gripper.boxes(gripper.opening_m), gripper.boxes(0.0), strict=True):
        (first_low, first_high), (last_low, last_high) = _bounds(*start), _bounds(*end)
        swept_low, swept_high = np.minimum(first_low, last_low), np.maximum(first_high, last_high)
        reached |= ((low <= swept_high + margin_m) & (high >= swept_low - margin_m)).all(1)
    return reached


def _bounds(box_to_gripper: np.ndarray, half_extents_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    reach = np.abs(box_to_gripper[:3, :3]) @ half_extents_m
    return box_to_gripper[:3, 3] - reach, box_to_gripper[:3, 3] + reach
