"""Where the gripper's straight lines end that do not end at the object."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.planning.settings import PlannerSettings
from manitwin.geometry.poses import transform

HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
"""About the approach axis: the same grasp with its fingers exchanged."""


class LineEnds:
    """Poses beside a gripper's pose ``(..., 4, 4)``."""

    def __init__(self, settings: PlannerSettings):
        """Take the lengths of the lines."""
        self._back = transform(translation=np.array([0, 0, -settings.approach_m]))
        self._lift_m = settings.lift_m

    def before(self, gripper_to_world: np.ndarray) -> np.ndarray:
        """Return where the approach to a pose begins, and the retreat from it ends."""
        return gripper_to_world @ self._back

    def above(self, gripper_to_world: np.ndarray) -> np.ndarray:
        """Return where the lift from a pose ends, and the lowering to it begins."""
        result = gripper_to_world.copy()
        result[..., 2, 3] += self._lift_m
        return result
