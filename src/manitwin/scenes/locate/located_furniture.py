"""Furniture of a located scene: the visible table, and boxes for all other visible obstacles on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manitwin.geometry.boxes import footprint
from manitwin.geometry.hull_distance import ConvexParts, PlacedParts, overlap_depth
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import StaticBox
from manitwin.scenes.layouts.surroundings import TABLE_M
from manitwin.scenes.locate.depth_view import DepthView, measured_noise_m
from manitwin.scenes.locate.located_objects import LocatedObject
from manitwin.scenes.locate.visible_obstacles import ObstacleBox, obstacle_boxes
from manitwin.scenes.locate.world_frame import WorldFrame, table_points, visible_rectangle
from manitwin.scenes.scene import Furniture, SupportRegion, SurfaceBox

_EDGE_M = 0.01
_LEAST_HALF_M = 0.001


def located_furniture(view: DepthView, objects: Sequence[LocatedObject], world: WorldFrame) -> tuple[Furniture, int]:
    """Return the furniture, and the number of obstacle boxes that were left out because they overlap a located object."""
    noise_m = measured_noise_m(view, np.ones(view.depth_m.shape, bool))
    located = np.any([each.thing.mask for each in objects], axis=0)
    surfaces = np.concatenate([each.surface for each in objects])
    low, high = visible_rectangle(
        table_points(view, world, noise_m), np.concatenate([footprint(each.corners) for each in objects])
    )
    (x, y), (half_x, half_y) = (low + high) / 2, (high - low) / 2 + _EDGE_M
    top = SurfaceBox(
        name="table",
        center_m=triple((x, y, world.table_m - TABLE_M / 2)),
        half_extents_m=triple((half_x, half_y, TABLE_M / 2)),
        material="wood",
    )
    support = SupportRegion(
        name="table", center_m=top.center_m[:2], half_extents_m=top.half_extents_m[:2], height_m=round(world.table_m, 6)
    )
    own = [each.parts_at(each.placed.object_to_world) for each in objects]
    boxes = [_box(number, each) for number, each in enumerate(obstacle_boxes(view, located, world, surfaces, noise_m))]
    free = [box for box in boxes if not any(overlap_depth(parts, _parts_of(box)) > 0 for parts in own)]
    furniture = Furniture(kind="table", support_height_m=support.height_m, boxes=(top, *free), supports=(support,))
    return furniture, len(boxes) - len(free)


def _box(number: int, seen: ObstacleBox) -> SurfaceBox:
    half = np.maximum((seen.high_m - seen.low_m) / 2, _LEAST_HALF_M)
    center = triple((seen.high_m + seen.low_m) / 2)
    return SurfaceBox(name=f"seen_{number:02d}", center_m=center, half_extents_m=triple(half), material="cloth")


def _parts_of(box: SurfaceBox) -> PlacedParts:
    static = StaticBox(box.name, np.array(box.half_extents_m), transform(translation=np.array(box.center_m)))
    return ConvexParts.of_box(static).at(static.box_to_world)


def triple(values: Sequence[float] | np.ndarray) -> tuple[float, float, float]:
    """Return three numbers rounded to micrometres, as in a scene file."""
    x, y, z = (round(float(v), 6) for v in values)
    return x, y, z
