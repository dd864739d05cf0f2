"""Where an arm is free with something in its hand that must not be tilted: an open vessel that is full of something."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from manitwin.episodes.planning.collision_world import FreeSpace
from manitwin.episodes.planning.problem import Phase


class LevelSpace:
    """Another free space, and in it the configurations at which what is held is tilted by ``most_rad`` at most."""

    def __init__(
        self,
        space: FreeSpace,
        gripper_pose: Callable[[np.ndarray], np.ndarray],
        level_to_world: np.ndarray,
        most_rad: float,
    ):
        """Take the forward kinematics, and a rotation ``(3, 3)`` of the gripper at which what it holds is level."""
        self._space, self._gripper_pose = space, gripper_pose
        self._up, self._least = level_to_world[2], float(np.cos(most_rad))

    def enter(self, phase: Phase, margin_m: float | None = None) -> None:
        """Test from now on what a phase forbids."""
        self._space.enter(phase, margin_m)

    def is_free(self, configuration: np.ndarray) -> bool:
        """Tell whether a configuration ``(n,)`` is level and free: the cheap test first."""
        return self.is_level(configuration) and self._space.is_free(configuration)

    def is_level(self, configuration: np.ndarray) -> bool:
        """Tell whether what is held is level: the world's vertical, in the gripper's frame, is about where it was."""
        return float(self._gripper_pose(configuration)[2, :3] @ self._up) >= self._least
