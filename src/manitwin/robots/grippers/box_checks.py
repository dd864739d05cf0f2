"""Consistency checks of grippers described by boxes: position of the boxes in the grasp frame versus the stated dimensions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manitwin.robots.grippers.box import Box
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.grippers.suction import SuctionGripper

TOLERANCE_M = 0.001
"""Rounding of drawings and collision boxes is smaller; the error of a grasp's width would be twice as large."""


def box_bounds(boxes: Sequence[Box]) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper corners of the boxes along the axes of the grasp frame, each ``(B, 3)``."""
    bounds = []
    for box in boxes:
        pose, half_m = box.placed()
        reach_m = np.abs(pose[:3, :3]) @ half_m
        bounds.append((pose[:3, 3] - reach_m, pose[:3, 3] + reach_m))
    low, high = np.moveaxis(np.array(bounds), 1, 0)
    return low, high


def check_jaws(gripper: ParallelGripper) -> None:
    """Raise ValueError unless the closed +X finger has its inner face at x = 0 and covers the pad given by the dimensions."""
    if not gripper.finger_boxes:
        raise ValueError("finger_boxes: is empty: give the boxes of the +X finger, closed")
    low, high = box_bounds(gripper.finger_boxes)
    half_y_m, half_z_m = gripper.pad_half_extents_m
    tip_m = gripper.tip_depth_m
    there = (low[:, 2] <= tip_m + TOLERANCE_M) & (high[:, 2] >= tip_m - TOLERANCE_M)
    if not there.any():
        raise ValueError(
            f"tip_depth_m: is {tip_m:g}, outside the fingers: the finger_boxes reach from {low[:, 2].min():.4g} to"
            f" {high[:, 2].max():.4g} along +Z; give the depth of the pads' centre"
        )
    inner_m = float(low[there, 0].min())
    if abs(inner_m) > TOLERANCE_M:
        raise ValueError(
            f"finger_boxes: the closed finger's inner face is at x = {inner_m:.4g} at the tips' depth, it must be at 0:"
            " give the boxes of the +X finger when closed; the jaws close along X, the other finger is the half turn about Z"
        )
    pad = there & (low[:, 0] <= inner_m + TOLERANCE_M)
    for axis, name, least_m, most_m in (
        (1, "Y", -half_y_m, half_y_m),
        (2, "Z", tip_m - half_z_m, tip_m + half_z_m),
    ):
        from_m, to_m = float(low[pad, axis].min()), float(high[pad, axis].max())
        if least_m < from_m - TOLERANCE_M or most_m > to_m + TOLERANCE_M:
            raise ValueError(
                f"pad_half_extents_m: the pads reach from {least_m:.4g} to {most_m:.4g} along {name}, the boxes that have the"
                f" inner face only from {from_m:.4g} to {to_m:.4g}: correct tip_depth_m, pad_half_extents_m or"
                f" finger_boxes"
            )


def check_cup(gripper: SuctionGripper) -> None:
    """Raise ValueError if a body box extends beyond the plane of the lip."""
    if gripper.body_boxes:
        end_m = float(box_bounds(gripper.body_boxes)[1][:, 2].max())
        if end_m > gripper.tip_depth_m + TOLERANCE_M:
            raise ValueError(
                f"body_boxes: they reach to {end_m:.4g} along +Z, past the lip at tip_depth_m ="
                f" {gripper.tip_depth_m:g}, which therefore could touch nothing: end the boxes before the lip"
            )
