"""Parallel-jaw gripper: two fingers that close along X."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from manitwin.robots.grippers.box import STRICT, Box, PlacedBox
from manitwin.robots.grippers.quantities import Length, Name, Positive, Source


@dataclass(frozen=True)
class ParallelGripper:
    """Parallel-jaw gripper.

    ``finger_boxes`` are those of the +X finger when closed (its inner face touches x = 0); the other finger is its half turn
    about Z. ``opening_m`` is the full stroke, ``tip_depth_m`` the coordinate of the fingertips' centre along +Z, and
    ``pad_half_extents_m`` half of the pad's width (Y) and height (Z), centred on the tip depth.
    """

    __pydantic_config__ = STRICT
    kind: ClassVar[str] = "parallel"

    name: Name
    sha256: str
    opening_m: Length
    tip_depth_m: Length
    force_n: Positive
    finger_friction: Positive
    pad_half_extents_m: tuple[Length, Length]
    finger_boxes: tuple[Box, ...]
    palm_boxes: tuple[Box, ...]
    source: Source

    def boxes(self, opening_m: float) -> list[PlacedBox]:
        """Return the boxes of palm and both fingers, ``(box_to_gripper (4, 4), half_extents_m (3,))``, at a given opening."""
        placed = [box.placed() for box in self.palm_boxes]
        for side in (1, -1):
            placed += [box.placed(opening_m / 2, side) for box in self.finger_boxes]
        return placed

    def symbol(self, width_m: float) -> list[PlacedBox]:
        """Return the gripper's own boxes, which represent it in drawings of many grasps."""
        return self.boxes(width_m)
