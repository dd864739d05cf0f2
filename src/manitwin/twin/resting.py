"""Classification of placements by how the object rests: upright, upside down, or lying on one side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.twin.record import Placement

UPRIGHT_DEG = 10.0
"""Largest angle of +Z from the vertical for a pose that counts as upright, or as upside down if +Z points down."""

Rest = Literal["upright", "upside_down", "lying"]


@dataclass(frozen=True)
class RestingPose:
    """A placement with its index in the record and its class; ``side_down`` is None unless the object lies."""

    number: int
    placement: Placement
    rest: Rest
    side_down: str | None
    tilt_deg: float


def resting_poses(placements: Sequence[Placement]) -> list[RestingPose]:
    """Classify all placements, sorted: those that were stable in simulation first, then by decreasing probability."""
    order = sorted(enumerate(placements), key=lambda each: (not each[1].settled, -each[1].probability))
    return [_resting_pose(number, placement) for number, placement in order]


def _resting_pose(number: int, placement: Placement) -> RestingPose:
    rotation = rotation_from_quaternion_wxyz(np.array(placement.quaternion_wxyz))
    rest = classify_rest(rotation)
    return RestingPose(number, placement, rest, side_down(rotation) if rest == "lying" else None, tilt_deg(rotation))


def classify_rest(object_to_plane: np.ndarray) -> Rest:
    """Return how an object rests, from the rotation ``object_to_plane (3, 3)``."""
    cosine, limit = float(object_to_plane[2, 2]), np.cos(np.radians(UPRIGHT_DEG))
    if cosine > limit:
        return "upright"
    return "upside_down" if cosine < -limit else "lying"


def side_down(object_to_plane: np.ndarray) -> str:
    """Return the side a lying object rests on: the one of ``+x``, ``-x``, ``+y``, ``-y`` that points down most."""
    down = -object_to_plane[2, :2]
    axis = int(np.abs(down).argmax())
    return f"{'+' if down[axis] > 0 else '-'}{'xy'[axis]}"


def tilt_deg(object_to_plane: np.ndarray) -> float:
    """Return the angle between the object's +Z axis and the vertical in degrees: 0 upright, 180 upside down."""
    return float(np.degrees(np.arccos(np.clip(object_to_plane[2, 2], -1.0, 1.0))))
