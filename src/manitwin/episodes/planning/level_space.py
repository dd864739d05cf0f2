"""Tilt-constrained free space for carrying objects that must stay level, such as filled open vessels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from manitwin.episodes.planning.collision_world import FreeSpace
from manitwin.episodes.planning.problem import Phase
from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import transform_points
from manitwin.geometry.rigid_body import PlacedObject

LEVEL_RAD = np.radians(20)  # tilt at which an open vessel that is three quarters full does not spill
OPENS_UPWARD, UPRIGHT_RAD = np.cos(np.radians(12)), np.radians(12)
TALL = 1.2  # ratio of height to width from which an object counts as standing


def must_stay_level(placed: PlacedObject, opening: Opening | None) -> bool:
    """Tell whether an object should be carried level: its opening points upwards, or it is tall.

    The content of a standing mug, bowl or bottle is unknown, so it may be full.
    """
    if opening is not None and float(placed.object_to_world[2, :3] @ opening.axis) >= OPENS_UPWARD:
        return True
    extents_m = np.ptp(transform_points(placed.object_to_world, np.concatenate(placed.body.hulls)), axis=0)
    return bool(extents_m[2] >= TALL * extents_m[:2].max())


def tilts_rad(rotations: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Return the tilts ``(N,)`` of rotations ``(N, 3, 3)`` relative to ``level (3, 3)``, independent of heading."""
    return np.arccos(np.clip(np.asarray(rotations)[:, 2] @ level[2], -1, 1))


class LevelSpace:
    """A free space restricted to configurations whose held object is tilted by at most ``most_rad``."""

    def __init__(
        self,
        space: FreeSpace,
        gripper_pose: Callable[[np.ndarray], np.ndarray],
        level_to_world: np.ndarray,
        most_rad: float,
    ):
        """Take the free space, the forward kinematics, and a gripper rotation ``(3, 3)`` at which the held object is level."""
        self._space, self._gripper_pose = space, gripper_pose
        self._up, self._least = level_to_world[2], float(np.cos(most_rad))

    def enter(self, phase: Phase, margin_m: float | None = None) -> None:
        """Select the phase, and optionally the margin, for the following tests."""
        self._space.enter(phase, margin_m)

    def is_free(self, configuration: np.ndarray) -> bool:
        """Tell whether a configuration ``(n,)`` is level and free; the cheap test comes first."""
        return self.is_level(configuration) and self._space.is_free(configuration)

    def is_level(self, configuration: np.ndarray) -> bool:
        """Tell whether the held object is level, by the world's vertical in the gripper frame."""
        return float(self._gripper_pose(configuration)[2, :3] @ self._up) >= self._least
