"""Obstacles of a problem as convex shapes: which hulls are merged, and which shapes support the target."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from manitwin.episodes.planning.convex_shapes import ConvexBody, ShapeStore
from manitwin.episodes.planning.libraries import coal, pin
from manitwin.episodes.planning.problem import PickPlaceProblem
from manitwin.geometry.rigid_body import is_plane_equivalent

# shapes within this distance, or overlapping by at most this, support the target: their contact is intended
BEARING_GAP_M = 0.003
SINK_M = 0.002  # additional depth allowed while the target is lifted off or put down
PLANE_M = 3.0  # half size of the box that represents the plane: beside a table, an arm meets the plane as well
HAND_REACH_M = 0.06  # obstacles closer to the target than this can be between hand and target


@dataclass(frozen=True)
class StaticShape:
    """Static shape, with the clearance (m) that the held target keeps from it at its start and at its goal.

    The allowances are negative if the shape supports the target: the permitted depth. None: the phase's default clearance.
    """

    name: str
    shape: Any
    pose: Any
    start_allowance_m: float | None
    goal_allowance_m: float | None


@dataclass(frozen=True)
class ObstacleShapes:
    """Shapes of a problem: static ones; the target's hulls, its convex hull, and the shapes used while it is carried."""

    statics: tuple[StaticShape, ...]
    target_hulls: tuple[Any, ...]
    target_whole: Any
    carried: tuple[Any, ...]
    start: Any
    goal: Any


def obstacle_shapes(
    problem: PickPlaceProblem,
    goal_object_to_world: np.ndarray,
    store: ShapeStore,
    margin_m: float,
    *,
    as_hulls: bool = False,
) -> ObstacleShapes:
    """Represent obstacles and the carried target by their convex hulls if that loses no free space, else by their own hulls.

    No free space is lost if the convex hull keeps ``margin_m`` from the target at start and goal, and is either nearly solid
    or out of the hand's way. ``as_hulls``: the target is carried as its hulls in any case.
    """
    target = store(problem.target.body)
    start, goal = pose_of(problem.target.object_to_world), pose_of(goal_object_to_world)
    placed: list[tuple[str, Any, Any]] = []
    for box in (*problem.static_boxes, *problem.fixtures):
        half_m = np.asarray(box.half_extents_m, float)
        if is_plane_equivalent(box):
            half_m = np.array([*np.maximum(half_m[:2], PLANE_M), half_m[2]])
        shape = coal.Box(2 * half_m)
        shape.computeLocalAABB()
        placed.append((box.name, shape, pose_of(box.box_to_world)))
    for obstacle in problem.obstacles:
        shapes, pose = store(obstacle.body), pose_of(obstacle.object_to_world)
        gap = min(_gap_m(shapes, pose, target, start), _gap_m(shapes, pose, target, goal))
        merged = obstacle.name not in problem.entered and (gap > HAND_REACH_M or (gap > margin_m and shapes.is_solid))
        placed += [(obstacle.name, shape, pose) for shape in ((shapes.whole,) if merged else shapes.hulls)]
    at_start = [signed_distance_m(target.whole, start, shape, pose) for _, shape, pose in placed]
    at_goal = [signed_distance_m(target.whole, goal, shape, pose) for _, shape, pose in placed]
    carried = (target.whole,)
    if as_hulls or min([*at_start, *at_goal], default=0.0) < -SINK_M:
        carried = target.hulls
        at_start = [_least_m(carried, start, shape, pose) for _, shape, pose in placed]
        at_goal = [_least_m(carried, goal, shape, pose) for _, shape, pose in placed]
    statics = tuple(
        StaticShape(name, shape, pose, _allowance_m(before), _allowance_m(after))
        for (name, shape, pose), before, after in zip(placed, at_start, at_goal, strict=True)
    )
    return ObstacleShapes(statics, target.hulls, target.whole, carried, start, goal)


def pose_of(matrix: np.ndarray) -> Any:
    """Return a pose ``(4, 4)`` as pinocchio's SE3."""
    return pin.SE3(np.ascontiguousarray(matrix, float))


def signed_distance_m(first: Any, first_pose: Any, second: Any, second_pose: Any) -> float:
    """Return the distance of two convex shapes; negative for the penetration depth."""
    return float(
        coal.distance(
            first,
            _transform(first_pose),
            second,
            _transform(second_pose),
            coal.DistanceRequest(),
            coal.DistanceResult(),
        )
    )


def _transform(pose: Any) -> Any:
    return coal.Transform3s(pose.rotation, pose.translation)


def _gap_m(obstacle: ConvexBody, pose: Any, target: ConvexBody, target_pose: Any) -> float:
    """Return the distance of the convex hulls, or a lower bound if that exceeds ``HAND_REACH_M``."""
    bound = float(np.linalg.norm(pose.translation - target_pose.translation)) - obstacle.radius_m - target.radius_m
    if bound > HAND_REACH_M:
        return bound
    return signed_distance_m(obstacle.whole, pose, target.whole, target_pose)


def _least_m(shapes: tuple[Any, ...], shapes_pose: Any, other: Any, other_pose: Any) -> float:
    return min(signed_distance_m(shape, shapes_pose, other, other_pose) for shape in shapes)


def _allowance_m(distance_m: float) -> float | None:
    return min(distance_m, 0.0) - SINK_M if abs(distance_m) < BEARING_GAP_M else None
