"""Located twins in the world, aligned with their closest upright placement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manitwin.geometry.hull_distance import ConvexParts, PlacedParts
from manitwin.geometry.poses import rotation_between, rotation_from_quaternion_wxyz, transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.scenes.locate.recognition import ViewedObject
from manitwin.scenes.locate.world_frame import WorldFrame
from manitwin.twin.loaded_twin import Twin

SNAP_RAD, STANDS_M = np.deg2rad(10.0), 0.015
"""Tolerances for standing: tilt from a placement, and distance of the lowest point from the table."""
_SURFACE_POINTS = 1500


@dataclass(frozen=True)
class LocatedObject:
    """A located twin in the world: ``seen (4, 4)`` as it was found, ``placed`` at its start pose for settling.

    ``placement`` is the index of its placement; None if it is in none.
    """

    placed: PlacedObject
    seen: np.ndarray
    placement: int | None
    twin: Twin
    thing: ViewedObject

    @property
    def corners(self) -> np.ndarray:
        """The corners ``(N, 3)`` of its hulls at the start pose."""
        return transform_points(self.placed.object_to_world, np.concatenate(self.placed.body.hulls))

    @property
    def surface(self) -> np.ndarray:
        """Points ``(N, 3)`` of its surface at the located pose."""
        points = self.thing.model.points
        return transform_points(self.seen, points[:: max(1, len(points) // _SURFACE_POINTS)])

    @cached_property
    def parts(self) -> ConvexParts:
        """Its hulls, for distance queries."""
        return ConvexParts.of(self.placed.body.hulls)

    def parts_at(self, object_to_world: np.ndarray) -> PlacedParts:
        """Return its hulls at a pose."""
        return self.parts.at(object_to_world)


def located_objects(things: Sequence[tuple[ViewedObject, Twin]], world: WorldFrame) -> tuple[LocatedObject, ...]:
    """Return the located objects in the world, each in its best pose; objects without a pose are left out."""
    found: list[LocatedObject] = []
    for thing, twin in things:
        if thing.location.poses:
            body = twin.rigid_body()
            seen = world.camera_to_world @ thing.location.poses[0].object_to_camera
            pose, placement = _upright(seen, twin, body.center_of_mass_m)
            above_m = float(transform_points(pose, np.concatenate(body.hulls))[:, 2].min()) - world.table_m
            if above_m < STANDS_M:
                pose[2, 3] -= above_m
            placed = PlacedObject(f"object_{len(found):02d}", twin.record.twin_id, body, pose)
            found.append(LocatedObject(placed, seen, placement, twin, thing))
    return tuple(found)


def _upright(seen: np.ndarray, twin: Twin, center: np.ndarray) -> tuple[np.ndarray, int | None]:
    """Return a pose rotated about the centre of mass into the closest placement, and the index of that placement."""
    ups = {
        number: seen[:3, :3] @ rotation_from_quaternion_wxyz(np.array(each.quaternion_wxyz))[2]
        for number, each in enumerate(twin.record.placements or [])
        if each.settled
    }
    if not ups:
        return np.array(seen), None
    number = max(ups, key=lambda place: (ups[place][2], -place))
    if ups[number][2] < np.cos(SNAP_RAD):
        return np.array(seen), None
    turn = rotation_between(ups[number], np.array([0.0, 0.0, 1.0]))
    middle = transform_points(seen, center[None])[0]
    return transform(turn, middle - turn @ middle) @ seen, number
