"""How fast joints and objects move in a timestep, measured by where they are before and after it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.physics.sapien.world import RobotWorld


class Speeds(NamedTuple):
    """The speeds of joints ``(n,)``, of objects' centres of mass ``(O, 3)`` and of their rotation ``(O, 3)``, world frame."""

    joints_rad_s: np.ndarray
    centers_m_s: np.ndarray
    objects_rad_s: np.ndarray


class StepSpeeds:
    """Measures the mean speeds of one timestep of a world.

    PhysX's own speeds are those at the step's end. There stiff drives have slowed joints down, and what is between fingers
    keeps the speed with which the solver pushed it against them: 0.2 m/s and 14 rad/s of a sponge that stands still.
    """

    def __init__(self, world: RobotWorld, timestep_s: float):
        """Look at the world as it is."""
        self._world, self._timestep_s = world, timestep_s
        self.begin()

    def begin(self) -> None:
        """Look at where everything is before the step."""
        self._joints_rad, self._centers_m, self._turns = self._look()

    def end(self) -> Speeds:
        """Return the speeds of the step that was made since."""
        joints_rad, centers_m, turns = self._look()
        return Speeds(
            (joints_rad - self._joints_rad) / self._timestep_s,
            (centers_m - self._centers_m) / self._timestep_s,
            (turns * self._turns.inv()).as_rotvec() / self._timestep_s,
        )

    def _look(self) -> tuple[np.ndarray, np.ndarray, Rotation]:
        poses = [body.entity_pose for body in self._world.bodies]
        centers = [(pose * body.cmass_local_pose).p for pose, body in zip(poses, self._world.bodies, strict=True)]
        return (
            np.concatenate([robot.joint_positions() for robot in self._world.robots]),
            np.array(centers, float),
            Rotation.from_quat(np.array([pose.q for pose in poses], float), scalar_first=True),
        )
