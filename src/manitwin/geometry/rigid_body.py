"""Rigid bodies for simulation: convex hulls with mass properties and friction, placed objects, and static boxes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manitwin.geometry.poses import quaternion_wxyz, transform_points
from manitwin.geometry.ray_caster import RayCaster

FURNITURE_FRICTION = 0.5
"""Static and dynamic friction of all furniture."""
LEAST_TABLE_M = 0.3
"""The least half extent of a table top: a smaller level box at z = 0 is not a table."""


@dataclass(frozen=True)
class RigidBody:
    """Convex hulls (each ``(V, 3)`` m) and the true mass properties, in the object frame.

    ``inertia_kg_m2 (3, 3)`` is about the centre of mass, in the axes of the object frame; it is not derived from the hulls.
    ``surface`` is the true surface if known, for suction cups, which depend on details that hulls smooth out.
    """

    hulls: tuple[np.ndarray, ...]
    mass_kg: float
    center_of_mass_m: np.ndarray
    inertia_kg_m2: np.ndarray
    friction_static: float
    friction_dynamic: float
    surface: RayCaster | None = None

    @cached_property
    def principal_inertia(self) -> tuple[np.ndarray, np.ndarray]:
        """The principal moments ``(3,)``, ascending, and the quaternion wxyz from their axes to the object's."""
        moments, axes = principal_frame(self.inertia_kg_m2)
        return moments, quaternion_wxyz(axes)


def principal_frame(inertia_kg_m2: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the principal moments ``(3,)``, ascending, and the right-handed rotation ``(3, 3)`` from their axes to the
    object's.
    """
    moments, axes = np.linalg.eigh(inertia_kg_m2)
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    return moments, axes


@dataclass(frozen=True)
class PlacedObject:
    """A twin's body at a pose ``object_to_world (4, 4)``; ``name`` is unique in the scene (``object_00``)."""

    name: str
    twin_id: str
    body: RigidBody
    object_to_world: np.ndarray

    @property
    def center_of_mass_m(self) -> np.ndarray:
        """The centre of mass in the world ``(3,)``, m."""
        return np.asarray(transform_points(self.object_to_world, self.body.center_of_mass_m[None])[0])


@dataclass(frozen=True)
class StaticBox:
    """A static box, such as a table top, shelf board or tray rim; ``half_extents_m (3,)`` in metres, world frame."""

    name: str
    half_extents_m: np.ndarray
    box_to_world: np.ndarray


def is_plane_equivalent(box: StaticBox) -> bool:
    """Return whether a box is a table top at z = 0, the robot's base height, that may be treated as an infinite plane.

    Physics and planners use a plane instead of such a box. In PhysX, contacts of hulls on a box persist from step to step, and
    a tall box that is set down keeps rocking by a degree or two. Of six cereal boxes released with up to 3 degrees of tilt, one
    had come to rest after 3 s on a box, and all on a plane.
    """
    top = box.box_to_world[:3, 2] * box.half_extents_m[2] + box.box_to_world[:3, 3]
    upright = box.box_to_world[2, 2] > 1 - 1e-9
    return bool(upright and abs(top[2]) < 1e-6 and box.half_extents_m[:2].min() >= LEAST_TABLE_M)
