"""Mean velocities of joints and objects over a time step, from poses before and after it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.physics.sapien.world import RobotWorld


class Speeds(NamedTuple):
    """Velocities of joints ``(n,)``, of objects' centres of mass ``(O, 3)``, and angular velocities ``(O, 3)``, world frame."""

    joints_rad_s: np.ndarray
    centers_m_s: np.ndarray
    objects_rad_s: np.ndarray


class StepSpeeds:
    """Measures the mean velocities over one time step of a world.

    PhysX's own velocities are those at the end of the step. By then stiff drives have decelerated the joints, and an object
    between fingers keeps the velocity with which the solver pushed it against them: 0.2 m/s and 14 rad/s for a sponge at
    rest.
    """

    def __init__(self, world: RobotWorld, timestep_s: float):
        """Record the current poses."""
        self._world, self._timestep_s = world, timestep_s
        self.begin()

    def begin(self) -> None:
        """Record the poses before the step."""
        self._joints_rad, self._centers_m, self._turns = self._look()

    def end(self) -> Speeds:
        """Return the mean velocities since ``begin``."""
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
