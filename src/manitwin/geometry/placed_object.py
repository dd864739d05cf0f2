"""An object in a scene: which twin it is, its body, and where it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.geometry.rigid_body import RigidBody

FURNITURE_FRICTION = 0.5
"""Static and dynamic, of every piece of furniture."""


@dataclass(frozen=True)
class PlacedObject:
    """A twin's body at a pose ``object_to_world (4, 4)``; ``name`` is its own in the scene (``object_00``)."""

    name: str
    twin_id: str
    body: RigidBody
    object_to_world: np.ndarray


@dataclass(frozen=True)
class StaticBox:
    """A box that does not move: a table's top, a shelf's board, a tray's rim. ``half_extents_m (3,)``, metres, world frame."""

    name: str
    half_extents_m: np.ndarray
    box_to_world: np.ndarray
