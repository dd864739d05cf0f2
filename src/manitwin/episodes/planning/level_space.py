"""Where an arm is free with something in its hand that must not be tilted: an open vessel that is full of something."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from manitwin.episodes.planning.collision_world import FreeSpace
from manitwin.episodes.planning.problem import Phase
from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import transform_points
from manitwin.geometry.rigid_body import PlacedObject

LEVEL_RAD = np.radians(20)  # of what is carried level: an open vessel that is three quarters full keeps what it holds
OPENS_UPWARD, UPRIGHT_RAD = np.cos(np.radians(12)), np.radians(12)
TALL = 1.2  # heights by widths, from which on something stands


def kept_level(placed: PlacedObject, opening: Opening | None) -> bool:
    """Tell whether an object is to be carried level from where it stands: its opening looks upward, or it is tall.

    Who moves a mug, a bowl or a bottle that stands does not know here whether there is something in it.
    """
    if opening is not None and float(placed.object_to_world[2, :3] @ opening.axis) >= OPENS_UPWARD:
        return True
    extents_m = np.ptp(transform_points(placed.object_to_world, np.concatenate(placed.body.hulls)), axis=0)
    return bool(extents_m[2] >= TALL * extents_m[:2].max())


def tilts_rad(rotations: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Return by how much rotations ``(N, 3, 3)`` of an object tilt it from another one ``(3, 3)``, by any heading: ``(N,)``."""
    return np.arccos(np.clip(np.asarray(rotations)[:, 2] @ level[2], -1, 1))


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
