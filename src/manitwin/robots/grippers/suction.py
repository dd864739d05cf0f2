"""Suction cup: vacuum, compliance of its lip, and the boxes of its body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from manitwin.robots.grippers.box import STRICT, Box, PlacedBox
from manitwin.robots.grippers.quantities import Gap, Length, Name, Positive, Slope, Source, Vacuum

SYMBOL_HALF_WIDTH_M = 0.002


@dataclass(frozen=True)
class SuctionGripper:
    """Suction cup whose lip lies in the plane z = ``tip_depth_m`` of the grasp frame, centred on the Z axis.

    ``vacuum_pa`` is the pressure difference over the disc of ``lip_radius_m``. The cup is pressed on until it stops: the
    surface may lie up to ``reach_m`` before or behind the lip's plane. ``max_tilt_rad`` is the largest tilt of the bellows,
    ``lip_travel_m`` the deformation of the lip that follows a non-planar surface, ``max_surface_angle_rad`` the largest angle
    of the surface against its plane, and ``ceiling_m`` how far a bump may rise into the cup or a dent recede from it.
    ``finger_friction`` is the lip's friction coefficient. ``body_boxes`` are the rest of the gripper, including the
    compressed cup.
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
        """The vacuum force: pressure difference times the lip's area."""
        return float(self.vacuum_pa * np.pi * self.lip_radius_m**2)

    @property
    def opening_m(self) -> float:
        """Largest thickness of an object: unlimited for a cup, so the size of the largest accepted object (``GateConfig``)."""
        return 1.0

    def boxes(self, opening_m: float) -> list[PlacedBox]:
        """Return the body's boxes, ``(box_to_gripper (4, 4), half_extents_m (3,))``, which must not touch the object."""
        return [box.placed() for box in self.body_boxes]

    def symbol(self, width_m: float) -> list[PlacedBox]:
        """Return the boxes that represent the gripper in drawings of many grasps: a stem and a disc."""
        rod, half = SYMBOL_HALF_WIDTH_M, self.tip_depth_m / 2
        stem = Box((0, 0, half), (rod, rod, half))
        disc = Box((0, 0, self.tip_depth_m - rod), (self.lip_radius_m, self.lip_radius_m, rod))
        return [stem.placed(), disc.placed()]
