"""Multi-finger hand controller: each finger closes along its straight line in joint space, as in the grasp trial."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np
from sapien import physx

from manitwin.physics.sapien.contacts import TargetContacts
from manitwin.physics.sapien.fingers import FingerClosing
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.trial import TrialSettings
from manitwin.robots.grippers.multi_finger import MultiFingerGripper


class FingersControl:
    """Controller of a multi-finger hand; targets and state are the positions of the hand's joints (rad)."""

    def __init__(self, world: RobotWorld, gripper: MultiFingerGripper, settings: TrialSettings):
        """Take a world whose robot has its hand open."""
        self._world, self._gripper, self._settings = world, gripper, settings
        self._told = self._before = world.robot.robot.open_hand
        self._goal: np.ndarray | None = None
        self._closing: FingerClosing | None = None

    @property
    def told(self) -> np.ndarray:
        """Joint targets ``(J,)`` rad."""
        return self._told

    @property
    def state(self) -> np.ndarray:
        """Joint positions ``(J,)`` rad."""
        return self._world.robot.hand_positions()

    @property
    def presses(self) -> bool:
        """Whether every finger presses or has reached its goal."""
        return self._closing is not None and self._closing.all_press

    def tell(self, told: np.ndarray) -> None:
        """Set the joint targets."""
        self._told = np.asarray(told, float)
        self._world.robot.set_hand_targets(self._told)

    def shaping(self, grasp_joints_rad: np.ndarray | None, opening_m: float | None = None) -> Iterator[np.ndarray]:
        """Yield targets to the joints before closing, and keep the closing goal for ``squeeze``."""
        if grasp_joints_rad is None:
            raise ValueError(f"a grasp of {self._gripper.name} needs its joints before closing and those to close to")
        self._before, self._goal = grasp_joints_rad
        self._closing = None
        return self._from(self._told, self._before)

    def squeeze(self) -> np.ndarray:
        """Return joint targets that advance all fingers that do not press yet."""
        if self._closing is None:
            assert self._goal is not None, "a hand closes on a grasp that it was shaped for"
            self._closing = FingerClosing(
                self._gripper,
                self._before,
                self._goal,
                range(len(self._gripper.joints)),
                strength=self._settings.force_n / self._gripper.force_n,
                frame_s=self._settings.frame_s,
            )
        return self._closing.advance_targets(self._world.robot.hand_positions())

    def closing_empty(self) -> Iterator[np.ndarray]:
        """Do nothing: only jaws are used as a tool."""
        return iter(())

    def opening(self) -> Iterator[np.ndarray]:
        """Release all fingers at once, so that none pushes the object over, then yield targets to the joints before closing."""
        self._closing = None
        here_rad = self._world.robot.hand_positions().copy()
        return chain([here_rad], self._from(here_rad, self._before))

    def look(self, contacts: Sequence[physx.PhysxContact]) -> None:
        """Do nothing: fingers measure their own contact torque."""

    def touches(self, touches: TargetContacts) -> TargetContacts:
        """Return the forces from the contacts."""
        return touches

    def _from(self, start_rad: np.ndarray, end_rad: np.ndarray) -> Iterator[np.ndarray]:
        step_rad = self._gripper.drive.speed_rad_s * self._settings.frame_s
        frames = int(np.ceil(np.abs(end_rad - start_rad).max() / step_rad))
        for frame in range(1, frames + 1):
            yield start_rad + frame / frames * (end_rad - start_rad)
