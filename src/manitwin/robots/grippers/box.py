"""Fields of grippers' files: boxes, and how strictly all are read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import ConfigDict

from manitwin.robots.grippers.quantities import Length, Position, Turn

STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
"""A key that means nothing is an error: it is a misspelt one."""

PlacedBox = tuple[np.ndarray, np.ndarray]
"""``box_to_gripper (4, 4)`` and ``half_extents_m (3,)``."""


@dataclass(frozen=True)
class Box:
    """A box of a gripper part: its centre (m), half extents (m) and rotation about Y (rad), in the grasp frame."""

    center_m: tuple[Position, Position, Position]
    half_extents_m: tuple[Length, Length, Length]
    rotation_y_rad: Turn = 0.0

    def placed(self, offset_x_m: float = 0.0, side: int = 1) -> PlacedBox:
        """Return the box moved along X; with ``side`` -1, turned by half a turn about Z after that."""
        angle = side * self.rotation_y_rad
        cosine, sine = np.cos(angle), np.sin(angle)
        box_to_gripper = np.eye(4)
        box_to_gripper[:3, :3] = [[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]
        x, y, z = self.center_m
        box_to_gripper[:3, 3] = [side * (x + offset_x_m), side * y, z]
        return box_to_gripper, np.array(self.half_extents_m)
