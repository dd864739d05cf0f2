"""Box primitives of gripper files, and the strict validation that all gripper files share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import ConfigDict

from manitwin.robots.grippers.quantities import Length, Position, Turn

STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
"""Unknown keys are errors, because they are usually misspelt."""

PlacedBox = tuple[np.ndarray, np.ndarray]
"""Pose ``box_to_gripper (4, 4)`` and ``half_extents_m (3,)``."""


@dataclass(frozen=True)
class Box:
    """Box of a gripper part: centre (m), half extents (m) and rotation about Y (rad), in the grasp frame."""

    center_m: tuple[Position, Position, Position]
    half_extents_m: tuple[Length, Length, Length]
    rotation_y_rad: Turn = 0.0

    def placed(self, offset_x_m: float = 0.0, side: int = 1) -> PlacedBox:
        """Return the box translated along X by ``offset_x_m``; for ``side`` -1, then rotated by a half turn about Z."""
        angle = side * self.rotation_y_rad
        cosine, sine = np.cos(angle), np.sin(angle)
        box_to_gripper = np.eye(4)
        box_to_gripper[:3, :3] = [[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]
        x, y, z = self.center_m
        box_to_gripper[:3, 3] = [side * (x + offset_x_m), side * y, z]
        return box_to_gripper, np.array(self.half_extents_m)
