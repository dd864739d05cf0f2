"""The least and the largest of what an environment takes: an arm's joints, and what its hand is told."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.two_arms import TwoArmPlanner
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.suction import SuctionGripper
from manitwin.robots.robot import Robot


def action_limits(robot: Robot, planner: PickPlacePlanner) -> tuple[np.ndarray, np.ndarray]:
    """Return the limits ``(n + h,) float32`` of the joints of all arms (rad), then of all hands.

    Joints have those of the URDF, not what plans keep within: an arm that follows a spline may go a little beyond that.
    Jaws may be told less than nothing, which presses; a cup's vacuum is 0 or 1, other hands have their joints' limits.
    """
    planners = (planner, planner.taker) if isinstance(planner, TwoArmPlanner) else (planner,)
    hands = [_hand_limits(each) for each in robot.arms or (robot,)]
    arms = [each.arm.limits_rad for each in planners]
    lowest, highest = zip(*arms, *hands, strict=True)
    return np.concatenate(lowest).astype(np.float32), np.concatenate(highest).astype(np.float32)


def _hand_limits(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    gripper = robot.gripper
    if isinstance(gripper, SuctionGripper):
        return np.zeros(1), np.ones(1)
    if isinstance(gripper, MultiFingerGripper):
        of_joint = {link.joint: link.limits for link in gripper.links}
        low, high = np.array([of_joint[name] for name in gripper.joints], float).T
        return low, high
    widest_m = np.array([gripper.opening_m])
    return -widest_m, widest_m
