"""What is recorded of an episode, 20 times a second."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RATE_HZ = 20


@dataclass(frozen=True)
class Recording:
    """States ``(T + 1, ...)`` and the actions ``(T, ...)`` between them; float32, SI, world frame, quaternions wxyz.

    Action t is what the controllers are told to reach by state t + 1. Objects are in the scene's order, the target at
    ``target``. ``gripper_opening_m`` is the distance between the pads. The tip is the twin's grasp frame (+Z approach, X
    closing). ``phase (T,)`` holds numbers of ``planning.problem.Phase``. ``finger_forces_n`` press on the target;
    ``unplanned_contact`` says that the robot touched with more than 0.5 N what it should not, since the state before.
    """

    target: int
    joint_positions_rad: np.ndarray
    joint_velocities_rad_s: np.ndarray
    gripper_opening_m: np.ndarray
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
    action_gripper_opening_m: np.ndarray
    action_tip_position_m: np.ndarray
    action_tip_quaternion_wxyz: np.ndarray
    phase: np.ndarray

    @property
    def steps(self) -> int:
        """The number T of actions."""
        return len(self.phase)
