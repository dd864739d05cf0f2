"""Recorder of an episode's states and actions at 20 Hz."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from manitwin.episodes.planning.problem import Phase
from manitwin.episodes.recording import Recording
from manitwin.episodes.step_speeds import Speeds
from manitwin.geometry.poses import quaternion_wxyz, without_sign_changes
from manitwin.physics.sapien.contacts import TargetContacts
from manitwin.physics.sapien.world import RobotWorld


class _State(NamedTuple):
    joint_positions_rad: np.ndarray
    joint_velocities_rad_s: np.ndarray
    hand: np.ndarray
    tips_to_world: np.ndarray
    object_positions_m: list[np.ndarray]
    object_quaternions_wxyz: list[np.ndarray]
    object_linear_velocities_m_s: np.ndarray
    object_angular_velocities_rad_s: np.ndarray
    granule_positions_m: np.ndarray | None


class _Action(NamedTuple):
    joint_positions_rad: np.ndarray
    hand: np.ndarray
    phase: Phase
    active_literal: int | None


class Recorder:
    """Records the first state, then each action with the resulting state; values of the first of two arms come first."""

    def __init__(self, world: RobotWorld, touches: TargetContacts, hand: np.ndarray):
        """Record the first state; ``hand (h,)`` is the hand's position."""
        self._world = world
        joints = sum(len(each.robot.arm_joints) for each in world.robots)
        at_rest = Speeds(  # no object is held yet
            np.zeros(joints),
            np.array([body.linear_velocity for body in world.bodies]),
            np.array([body.angular_velocity for body in world.bodies]),
        )
        self._states: list[_State] = [self._state(at_rest, hand)]
        self._touches, self._unplanned, self._actions = [touches], [False], list[_Action]()

    def add(
        self,
        joint_positions_rad: np.ndarray,
        hand_told: np.ndarray,
        hand: np.ndarray,
        phase: Phase,
        speeds: Speeds,
        touches: TargetContacts,
        *,
        unplanned: bool,
        literal: int | None = None,
    ) -> None:
        """Record an action and the resulting state, which is the world's current state with ``speeds``.

        The action is the command: joints ``(n,)`` rad and ``hand_told (h,)``. ``hand (h,)`` is the hand's current position,
        ``literal`` the number of the goal's literal that the action serves.
        """
        self._actions.append(_Action(joint_positions_rad, hand_told, phase, literal))
        self._states.append(self._state(speeds, hand))
        self._touches.append(touches)
        self._unplanned.append(unplanned)

    def recording(self, tip_poses: Callable[[np.ndarray], np.ndarray]) -> Recording:
        """Return the recording; quaternion signs are continuous over time (``without_sign_changes``).

        ``tip_poses`` is the forward kinematics from the joints ``(n,)`` of all arms to their tips in the world
        ``(arms, 4, 4)``.
        """
        told = _columns(self._actions)
        states = _columns(self._states)
        tips, told_tips = (
            np.array(states.pop("tips_to_world")),
            np.array([tip_poses(q) for q in told["joint_positions_rad"]]),
        )
        granules_m = states.pop("granule_positions_m")
        object_quaternions = without_sign_changes(np.array(states.pop("object_quaternions_wxyz")))
        tip_quaternions = without_sign_changes(quaternion_wxyz(tips[:, :, :3, :3]))
        told_quaternions = without_sign_changes(quaternion_wxyz(told_tips[:, :, :3, :3]), tip_quaternions[0])
        return Recording(
            target=self._world.target,
            **{name: np.array(values, np.float32) for name, values in states.items()},
            object_quaternions_wxyz=object_quaternions.astype(np.float32),
            tip_position_m=_flat(tips[:, :, :3, 3]),
            tip_quaternion_wxyz=_flat(tip_quaternions),
            finger_forces_n=np.array([touches.finger_forces_n for touches in self._touches], np.float32),
            target_on_support=np.array([touches.on_support for touches in self._touches]),
            unplanned_contact=np.array(self._unplanned),
            action_joint_positions_rad=np.array(told["joint_positions_rad"], np.float32),
            action_hand=np.array(told["hand"], np.float32),
            action_tip_position_m=_flat(told_tips[:, :, :3, 3]),
            action_tip_quaternion_wxyz=_flat(told_quaternions),
            phase=np.array(told["phase"], np.uint8),
            granule_positions_m=None if granules_m[0] is None else np.array(granules_m, np.float32),
            active_literal=None if None in told["active_literal"] else np.array(told["active_literal"], np.uint8),
        )

    def _state(self, speeds: Speeds, hand: np.ndarray) -> _State:
        robots, bodies = self._world.robots, self._world.bodies
        poses = [body.entity_pose for body in bodies]
        return _State(
            joint_positions_rad=np.concatenate([robot.joint_positions() for robot in robots]),
            joint_velocities_rad_s=speeds.joints_rad_s,
            hand=hand,
            tips_to_world=np.array([robot.gripper_pose() for robot in robots]),
            object_positions_m=[pose.p for pose in poses],
            object_quaternions_wxyz=[pose.q for pose in poses],
            object_linear_velocities_m_s=speeds.centers_m_s,
            object_angular_velocities_rad_s=speeds.objects_rad_s,
            granule_positions_m=None if (granules := self._world.granules) is None else granules.positions_m(),
        )


def _columns(rows: Sequence[_State] | Sequence[_Action]) -> dict[str, list[Any]]:
    return {name: list(values) for name, values in zip(rows[0]._fields, zip(*rows, strict=True), strict=True)}


def _flat(of_arms: np.ndarray) -> np.ndarray:
    """Return values of arms ``(T, arms, k)`` concatenated per row, ``(T, arms * k)``, as in episode files."""
    return of_arms.reshape(len(of_arms), -1).astype(np.float32)
