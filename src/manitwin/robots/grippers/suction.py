"""A suction cup: its vacuum, how far its lip gives way, and the boxes around it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from manitwin.robots.grippers.box import STRICT, Box, PlacedBox
from manitwin.robots.grippers.quantities import Gap, Length, Name, Positive, Slope, Source, Vacuum

SYMBOL_HALF_WIDTH_M = 0.002


@dataclass(frozen=True)
class SuctionGripper:
    """A suction cup whose lip lies in the plane z = ``tip_depth_m`` of the grasp frame, around the Z axis.

    ``vacuum_pa`` is the pressure difference over the disc of ``lip_radius_m``. The cup is pressed on until it stops: a surface
    may lie ``reach_m`` before or behind the lip's plane. ``max_tilt_rad`` is how far the bellows turn, ``lip_travel_m`` how
    far the lip bends to a surface that is no plane, ``max_surface_angle_rad`` the steepest surface against its plane that
    it seals on, ``ceiling_m`` how far a bump may rise into the cup or a dent sink away from it. ``finger_friction`` is the
    lip's. ``body_boxes`` are what else there is of the gripper, the compressed cup included.
    """

    __pydantic_config__ = STRICT
    kind: ClassVar[str] = "suction"

    name: Name
    sha256: str
    lip_radius_m: Length
    lip_travel_m: Gap
    reach_m: Gap
    max_tilt_rad: Slope
    ceiling_m: Gap
    max_surface_angle_rad: Slope
    vacuum_pa: Vacuum
    tip_depth_m: Length
    finger_friction: Positive
    body_boxes: tuple[Box, ...]
    source: Source

    @property
    def force_n(self) -> float:
        """The force that pulls the cup off: pressure difference times area."""
        return float(self.vacuum_pa * np.pi * self.lip_radius_m**2)

    @property
    def opening_m(self) -> float:
        """The thickest thing that it can hold: any, so the size of the largest object there is (``GateConfig``)."""
        return 1.0

    def boxes(self, opening_m: float) -> list[PlacedBox]:
        """Return ``(box_to_gripper 4x4, half_extents_m (3,))`` of all that may not touch; there is nothing to open."""
        return [box.placed() for box in self.body_boxes]

    def symbol(self, width_m: float) -> list[PlacedBox]:
        """Return the boxes that stand for the gripper in a drawing of many grasps: a stem and a disc."""
        rod, half = SYMBOL_HALF_WIDTH_M, self.tip_depth_m / 2
        stem = Box((0, 0, half), (rod, rod, half))
        disc = Box((0, 0, self.tip_depth_m - rod), (self.lip_radius_m, self.lip_radius_m, rod))
        return [stem.placed(), disc.placed()]
