"""Action limits of an environment: bounds of arm joints and hand commands, and validation of actions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.two_arms import TwoArmPlanner
from manitwin.errors import UsageError
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.suction import SuctionGripper
from manitwin.robots.robot import Robot


def action_limits(robot: Robot, planner: PickPlacePlanner) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper limits ``(n + h,) float32`` of the joints of all arms (rad), followed by those of all hands.

    Joint limits are those of the URDF, not the narrower ones of planning, because an arm that follows a spline may exceed the
    latter slightly. Jaws accept negative openings, which increase the pressing force. A cup's vacuum is 0 or 1; other hands
    have their joint limits.
    """
    planners = (planner, planner.taker) if isinstance(planner, TwoArmPlanner) else (planner,)
    hands = [_hand_limits(each) for each in robot.arms or (robot,)]
    arms = [each.arm.limits_rad for each in planners]
    lowest, highest = zip(*arms, *hands, strict=True)
    return np.concatenate(lowest).astype(np.float32), np.concatenate(highest).astype(np.float32)


def checked_action(action: object, names: Sequence[str]) -> np.ndarray:
    """Return an action ``(n + h,)`` as floats; ``names`` are those of its components.

    Raises UsageError for another shape or non-finite values, which would leave the simulation without a valid state.
    """
    try:
        told = np.asarray(action, float)
    except (TypeError, ValueError) as error:
        raise UsageError(f"action: not numbers ({error}); give {len(names)}: {', '.join(names)}") from error
    if told.shape != (len(names),):
        raise UsageError(f"action has shape {told.shape}; give {len(names)} numbers: {', '.join(names)}")
    if not np.isfinite(told).all():
        wrong = ", ".join(name for name, value in zip(names, told, strict=True) if not np.isfinite(value))
        raise UsageError(f"action is not finite for {wrong}; check the output of the policy")
    return told


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
