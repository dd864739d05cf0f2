"""In which placement a thing begins that a hand with joints is to pick: one in which its fingers have room over the table."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from manitwin.episodes.planning.grasp_candidates import CLOSED
from manitwin.episodes.planning.problem import Grasp
from manitwin.geometry.boxes import box_corners
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.scenes.layouts.pool import StandingPose

CLEARANCE_M = 0.002
LEAST_LIKELY = 0.03


def placement_with_room(
    placements: Sequence[StandingPose], grasps: Sequence[Grasp], gripper: MultiFingerGripper
) -> StandingPose | None:
    """Return the likeliest placement, an upright one first, in which some grasp's hand stays above the plane while it closes.

    None: no placement is so; those that hardly ever occur are not asked.
    """
    corners_of = cache(lambda number: _corners(gripper, grasps[number]))
    likely = [pose for pose in placements if pose.probability >= LEAST_LIKELY]
    for placement in sorted(likely, key=lambda pose: (pose.upright, pose.probability), reverse=True):
        for number, grasp in enumerate(grasps):
            up = (placement.object_to_plane @ grasp.gripper_to_object)[2]
            if up[3] > 0 and float((corners_of(number) @ up[:3]).min() + up[3]) >= CLEARANCE_M:
                return placement
    return None


def _corners(gripper: MultiFingerGripper, grasp: Grasp) -> np.ndarray:
    """Return the corners ``(N, 3)`` of all that a hand covers before it closes and on its way, in the grasp frame."""
    assert grasp.joints_rad is not None
    before, to = grasp.joints_rad
    boxes = [box for closed in (0.0, *CLOSED) for box in gripper.boxes_at(before + closed * (to - before))]
    return np.concatenate([box_corners(half, pose) for pose, half in boxes])
