"""Parallel jaw controller: both jaws share one target, which closes them until they press and keeps pressing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from sapien import physx

from manitwin.physics.sapien.contacts import TargetContacts
from manitwin.physics.sapien.robot import SapienRobot
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.shared_target import SharedTarget
from manitwin.physics.trial import TrialSettings

PRESSING_SHARE = 0.98  # share of the closing force at which the target has stopped advancing


class JawsControl:
    """Controller of parallel jaws; target and state are the opening (m)."""

    def __init__(self, world: RobotWorld, settings: TrialSettings):
        """Take a world whose current robot has open jaws."""
        self._world, self._settings = world, settings
        self._number = world.robots.index(world.robot)
        self._full_m = self._open_m = self._target_m = world.robot.robot.gripper.opening_m
        self._shared = SharedTarget(self._full_m, settings)

    @property
    def _robot(self) -> SapienRobot:
        """The robot, looked up in the world so that this controller does not keep it alive."""
        return self._world.robots[self._number]

    @property
    def told(self) -> np.ndarray:
        """Target of the opening ``(1,)`` m."""
        return np.array([self._target_m])

    @property
    def state(self) -> np.ndarray:
        """Opening ``(1,)`` m."""
        return np.array([self._robot.opening_m()])

    @property
    def presses(self) -> bool:
        """Whether the target is far enough inside the held object to press with about the closing force."""
        pressing_n = (self._robot.opening_m() - self._target_m) / 2 * self._settings.finger_stiffness_n_m
        return pressing_n > PRESSING_SHARE * self._settings.force_n

    def tell(self, told: np.ndarray) -> None:
        """Set the target of the opening, ``told (1,)`` m."""
        self._target_m = float(told[0])
        self._robot.set_opening_target(self._target_m)

    def shaping(self, grasp_joints_rad: np.ndarray | None, opening_m: float | None = None) -> Iterator[np.ndarray]:
        """Yield targets to a grasp's opening, at the closing speed."""
        self._open_m = self._full_m if opening_m is None else opening_m
        return self.opening()

    def squeeze(self) -> np.ndarray:
        """Return the target advanced by one frame."""
        return np.array([2 * self._shared.advance_target(self._robot.opening_m() / 2)])

    def closing_empty(self) -> Iterator[np.ndarray]:
        """Yield targets that close the jaws at the closing speed, without a pressing force."""
        target_m = self._target_m
        while target_m > 0:
            target_m = max(0.0, target_m - self._way_m)
            yield np.array([target_m])

    def opening(self) -> Iterator[np.ndarray]:
        """Yield targets to the release opening at the closing speed; the next closing starts from there."""
        self._shared = SharedTarget(self._open_m, self._settings)
        target_m = max(self._target_m, 0.0)
        while target_m != self._open_m:
            target_m += float(np.clip(self._open_m - target_m, -self._way_m, self._way_m))
            yield np.array([target_m])

    def look(self, contacts: Sequence[physx.PhysxContact]) -> None:
        """Do nothing: jaws measure their own force."""

    def touches(self, touches: TargetContacts) -> TargetContacts:
        """Return the forces from the contacts."""
        return touches

    @property
    def _way_m(self) -> float:
        return 2 * self._settings.close_speed_m_s * self._settings.frame_s
