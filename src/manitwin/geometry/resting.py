"""How an object rests on a plane: upright, upside down, or lying on one of its sides."""

from __future__ import annotations

from typing import Literal

import numpy as np

UPRIGHT_DEG = 10.0
"""A pose whose +Z axis is within this of the vertical is upright, or upside down where +Z points down."""

Rest = Literal["upright", "upside_down", "lying"]


def rest_of(object_to_plane: np.ndarray) -> Rest:
    """Return how an object rests, by where the rotation ``object_to_plane (3, 3)`` takes its +Z axis."""
    cosine, limit = float(object_to_plane[2, 2]), np.cos(np.radians(UPRIGHT_DEG))
    if cosine > limit:
        return "upright"
    return "upside_down" if cosine < -limit else "lying"


def side_down(object_to_plane: np.ndarray) -> str:
    """Return the side that a lying object lies on: the one of ``+x``, ``-x``, ``+y``, ``-y`` that points down most."""
    down = -object_to_plane[2, :2]
    axis = int(np.abs(down).argmax())
    return f"{'+' if down[axis] > 0 else '-'}{'xy'[axis]}"


def tilt_deg(object_to_plane: np.ndarray) -> float:
    """Return the angle (degrees) between the object's +Z axis and the vertical: 0 upright, 180 upside down."""
    return float(np.degrees(np.arccos(np.clip(object_to_plane[2, 2], -1.0, 1.0))))
