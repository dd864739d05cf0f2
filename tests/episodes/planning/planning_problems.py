"""A table, a brick on it and grasps from above: problems whose answers are known."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.planning.problem import Grasp, PickPlaceProblem
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject, RigidBody, StaticBox

TABLE = StaticBox("table", np.array([0.6, 1.0, 0.05]), transform(translation=np.array([0.35, 0, -0.05])))
FROM_ABOVE = np.diag([1.0, -1.0, -1.0])  # closes along the object's x
TIP_DEPTH_M = 0.1034


def box_hull(half_extents_m: tuple[float, float, float], center_m: tuple[float, float, float]) -> np.ndarray:
    """The corners of a box."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return signs * np.array(half_extents_m) + np.array(center_m)


def body(*hulls: np.ndarray) -> RigidBody:
    """A light body of hulls."""
    return RigidBody(hulls, 0.1, np.array([0, 0, 0.05]), np.eye(3) * 1e-4, 0.8, 0.8)


def brick(half_height_m: float = 0.05) -> RigidBody:
    """40 x 60 mm, upright."""
    return body(box_hull((0.02, 0.03, half_height_m), (0, 0, half_height_m)))


def above(height_m: float, rotation: np.ndarray = FROM_ABOVE) -> np.ndarray:
    """A grasp from above whose fingertips' centre is at a height on the object's axis."""
    return transform(rotation, np.array([0, 0, height_m]) - TIP_DEPTH_M * rotation[:, 2])


def standing(x_m: float, y_m: float, yaw_rad: float = 0.0, z_m: float = 0.0) -> np.ndarray:
    """An upright pose."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return transform(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.array([x_m, y_m, z_m]))


def grasps_from_above(*heights_m: float) -> tuple[Grasp, ...]:
    """Grasps of the brick at heights, in this order."""
    return tuple(Grasp(f"at {height} m", above(height), 0.04) for height in heights_m)


def problem(
    start: np.ndarray,
    goal: np.ndarray,
    grasps: tuple[Grasp, ...] | None = None,
    obstacles: tuple[PlacedObject, ...] = (),
    boxes: tuple[StaticBox, ...] = (TABLE,),
    target: RigidBody | None = None,
    seed: int = 0,
) -> PickPlaceProblem:
    """Move the brick from a pose to 1 mm above another."""
    goal = goal.copy()
    goal[2, 3] += 0.001
    placed = PlacedObject("target", "00" * 8, target or brick(), start)
    return PickPlaceProblem(placed, goal, grasps or grasps_from_above(0.08, 0.075, 0.07), obstacles, boxes, seed)


def wall(x_m: float, y_m: float, half_extents_m: tuple[float, float, float]) -> StaticBox:
    """A box that stands on the table."""
    return StaticBox("wall", np.array(half_extents_m), transform(translation=np.array([x_m, y_m, half_extents_m[2]])))
