"""Joints that an asset's file declares, including those of bodies that are not read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

Joints = Literal["part", "lock", "keep"]
"""How a reader treats moving links.

- ``part``: it reads only the first rigid part.
- ``lock``: it reads all links as one rigid body.
- ``keep``: it reads all links and their joints.
"""

ABOUT_AN_AXIS = ("revolute", "continuous", "prismatic", "screw", "hinge", "slide")
TURNS = ("revolute", "hinge")
"""Joint kinds that turn between two limits; a continuous joint has no limits."""
LIMITED = ("revolute", "prismatic")
"""Joint kinds for which the URDF specification requires a <limit>."""


@dataclass(frozen=True)
class DeclaredJoint:
    """One declared joint, with ``kind`` in the terms of its format; None marks what the file does not state.

    ``axis (3,)`` is in the joint's frame as written, NaN where the text is not three numbers. ``lower`` and ``upper`` are in
    radians or metres, infinite where the file declares the joint unlimited. ``follows`` names the joint that this one mimics.
    """

    name: str
    kind: str
    parent: str
    child: str
    axis: np.ndarray | None = None
    lower: float | None = None
    upper: float | None = None
    follows: str | None = None
