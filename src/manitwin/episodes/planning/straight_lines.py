"""Straight lines of the gripper: their end poses near an object, and the arm's joint path along them."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.episodes.planning.problem import PlannerSettings
from manitwin.geometry.poses import transform

KNOT_STEP_M = 0.02
TURN_SCALE_M = 0.1  # length equivalent of a rotation by one radian
LEAST_KNOTS = 4
LARGEST_KNOT_RAD = 0.7  # a larger change between knots is a jump to another branch
OFF_LINE_M = 0.0005
OFF_LINE_RAD = 0.002
ITERATIONS = 20

HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
"""Rotation by 180 degrees about the approach axis: the same grasp with its fingers exchanged."""


def straight_line(arm: ArmKinematics, start: np.ndarray, end_to_world: np.ndarray) -> CubicSpline | None:
    """Return joint positions over [0, 1] that move the grasp frame on a straight line to a pose ``(4, 4)``, or None.

    Position is linear, rotation is about a fixed axis. Knots every 2 cm come from inverse kinematics, each extrapolated from
    the last two. A cubic spline between them must stay within half a millimetre of the line.
    """
    start_to_world = arm.gripper_pose(start)
    turn = Rotation.from_matrix(start_to_world[:3, :3].T @ end_to_world[:3, :3]).as_rotvec()
    way_m = float(np.linalg.norm(end_to_world[:3, 3] - start_to_world[:3, 3]))
    count = max(LEAST_KNOTS, int(np.ceil(max(way_m, float(np.linalg.norm(turn)) * TURN_SCALE_M) / KNOT_STEP_M)))
    halves = np.arange(2 * count + 1) / (2 * count)
    poses = _poses_between(start_to_world, end_to_world, turn, halves)
    knots = [start]
    for pose in poses[2::2]:
        guess = knots[-1] if len(knots) == 1 else 2 * knots[-1] - knots[-2]
        knot = arm.inverse(pose, np.minimum(np.maximum(guess, arm.lower), arm.upper), ITERATIONS)
        if knot is None or np.abs(knot - knots[-1]).max() > LARGEST_KNOT_RAD:
            return None
        knots.append(knot)
    path = CubicSpline(halves[::2], np.array(knots))
    between = path(halves[1::2])
    return path if arm.within_limits(between) and _stays_on_line(arm, between, poses[1::2]) else None


def _poses_between(start: np.ndarray, end: np.ndarray, turn: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the poses ``(N, 4, 4)`` at parameters ``places (N,)`` of the line."""
    poses = np.tile(np.eye(4), (len(places), 1, 1))
    poses[:, :3, 3] = start[:3, 3] + places[:, None] * (end[:3, 3] - start[:3, 3])
    poses[:, :3, :3] = start[:3, :3] @ Rotation.from_rotvec(places[:, None] * turn).as_matrix()
    return poses


def _stays_on_line(arm: ArmKinematics, configurations: np.ndarray, poses: np.ndarray) -> bool:
    """Tell whether configurations reach their poses, to half a millimetre and a tenth of a degree."""
    reached = np.array([arm.gripper_pose(configuration) for configuration in configurations])
    off_m = np.linalg.norm(reached[:, :3, 3] - poses[:, :3, 3], axis=1)
    off_rad = np.linalg.norm(reached[:, :3, :3] - poses[:, :3, :3], axis=(1, 2)) / np.sqrt(2)
    return bool((off_m < OFF_LINE_M).all() and (off_rad < OFF_LINE_RAD).all())


class LineEnds:
    """End poses of straight lines, relative to a gripper pose ``(..., 4, 4)``."""

    def __init__(self, settings: PlannerSettings):
        """Take the lengths of the lines."""
        self._back = transform(translation=np.array([0, 0, -settings.approach_m]))
        self._lift_m = settings.lift_m

    def approach_start(self, gripper_to_world: np.ndarray) -> np.ndarray:
        """Return the start of the approach to a pose, which is also the end of the retreat from it."""
        return gripper_to_world @ self._back

    def lift_end(self, gripper_to_world: np.ndarray) -> np.ndarray:
        """Return the end of the lift from a pose, which is also the start of lowering to it."""
        result = gripper_to_world.copy()
        result[..., 2, 3] += self._lift_m
        return result
