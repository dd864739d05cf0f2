"""Recordings of episodes at 20 Hz, and their actions as differences from the preceding states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

RATE_HZ = 20


@dataclass(frozen=True)
class Recording:
    """States ``(T + 1, ...)`` and the actions ``(T, ...)`` between them; float32, SI, world frame, quaternions wxyz.

    Action t is the command to be reached by state t + 1. Velocities are those of the time step that ended in a state, for
    objects of the centre of mass. Objects are in the scene's order, the target at index ``target``.

    ``hand (T + 1, h)`` is the hand's state: the opening of jaws (m), a cup's plunger (m), or the joints of other hands (rad).
    ``action_hand (T, h)`` is its command: the same, or for a cup 1 if the vacuum is on, else 0. The tip is the grasp frame:
    its origin at the gripper's base, not between the fingertips, +Z approach, X closing. ``phase (T,)`` holds numbers of
    ``planning.problem.Phase``.

    ``finger_forces_n`` are the forces on the target from two sides: of the two jaws, or of thumb and palm and of the other
    fingers; for a sealed cup, both are the vacuum force less the pull. ``unplanned_contact`` tells whether the robot had an
    unplanned contact of more than 0.5 N since the preceding state.

    With granules, ``granule_positions_m (T + 1, N, 3)`` are their centres and ``granules_in_objects (T + 1, O)`` the numbers
    in each object. For a goal of several literals, ``active_literal (T,)`` is the number of the one being worked on;
    ``target`` is that of the last one, while contacts are those of the object handled at the time (``handled_objects``).

    For two arms, all arrays of joints, hands, tips and fingers contain the first arm's values followed by the second's.
    """

    target: int
    joint_positions_rad: np.ndarray
    joint_velocities_rad_s: np.ndarray
    hand: np.ndarray
    tip_position_m: np.ndarray
    tip_quaternion_wxyz: np.ndarray
    object_positions_m: np.ndarray
    object_quaternions_wxyz: np.ndarray
    object_linear_velocities_m_s: np.ndarray
    object_angular_velocities_rad_s: np.ndarray
    finger_forces_n: np.ndarray
    target_on_support: np.ndarray
    unplanned_contact: np.ndarray
    action_joint_positions_rad: np.ndarray
    action_hand: np.ndarray
    action_tip_position_m: np.ndarray
    action_tip_quaternion_wxyz: np.ndarray
    phase: np.ndarray
    granule_positions_m: np.ndarray | None = None
    granules_in_objects: np.ndarray | None = None
    active_literal: np.ndarray | None = None

    @property
    def gripper_opening_m(self) -> np.ndarray:
        """Distance between the pads of jaws ``(T + 1,)``."""
        return np.asarray(self.hand[:, 0])

    @property
    def action_gripper_opening_m(self) -> np.ndarray:
        """Commanded distance between the pads of jaws ``(T,)``."""
        return np.asarray(self.action_hand[:, 0])

    @property
    def steps(self) -> int:
        """The number T of actions."""
        return len(self.phase)


def joint_delta(recording: Recording) -> np.ndarray:
    """Return ``(T, n + h) float32``: the arm's targets minus its positions, rad, followed by the hand commands."""
    moved = recording.action_joint_positions_rad - recording.joint_positions_rad[:-1]
    return _with_hand(moved, recording)


def tip_delta(recording: Recording) -> np.ndarray:
    """Return ``(T, 6 + h) float32``: the difference of each tip's target from its pose, followed by the hand commands.

    Three translations (m) and a rotation vector (rad), both along the world axes, which are those of the robot's base:
    ``p_target = p + d[:3]``, ``R_target = exp(d[3:6]) R``. The axes are those of ManiSkill's ``pd_ee_delta_pose``
    (``root_translation:root_aligned_body_rotation``), not scaled to [-1, 1]; ManiSkill's reference point is between the
    fingertips.
    """
    moved = (recording.action_tip_position_m - recording.tip_position_m[:-1]).reshape(-1, 3)
    before = Rotation.from_quat(recording.tip_quaternion_wxyz[:-1].reshape(-1, 4), scalar_first=True)
    after = Rotation.from_quat(recording.action_tip_quaternion_wxyz.reshape(-1, 4), scalar_first=True)
    twists = np.hstack([moved, (after * before.inv()).as_rotvec()])
    return _with_hand(twists.reshape(recording.steps, -1), recording)


def tip_poses(position_m: np.ndarray, quaternion_wxyz: np.ndarray) -> np.ndarray:
    """Return the tip poses of one or two arms ``(T, 7 arms)``, arm by arm, from ``(T, 3 arms)`` and ``(T, 4 arms)``."""
    rows = len(position_m)
    poses = np.concatenate([position_m.reshape(rows, -1, 3), quaternion_wxyz.reshape(rows, -1, 4)], axis=2)
    return np.asarray(poses.reshape(rows, -1))


def _with_hand(delta: np.ndarray, recording: Recording) -> np.ndarray:
    return np.hstack([delta, recording.action_hand]).astype(np.float32)
