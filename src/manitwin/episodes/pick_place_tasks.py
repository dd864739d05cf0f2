"""Pick-and-place tasks: random starts and goals on a table in front of a robot, with or without other objects."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from manitwin.geometry.boxes import footprint, separation_m
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject, RigidBody
from manitwin.robots.robot import Workspace
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose
from manitwin.scenes.scene import SupportRegion

MIN_MOVE_M = 0.15
"""The shortest way from start to goal, as in the episodes of docs/measured/robot_data.md."""
MIN_GAP_M = 0.03
"""Between the footprints of two objects: room for a finger."""
OTHERS_RADIUS_FACTOR = 1.2
OTHERS_ANGLE_FACTOR = 1.4
"""How much farther than the target the others may stand: what is beyond the arm's reach is in nobody's way."""
NEARER_RADIUS_FACTOR = 0.75
"""How much nearer to its base than its workspace an arm may still put something down."""
POSES_TRIED, OTHERS_TRIED = 200, 20


@dataclass(frozen=True)
class Placeable:
    """A twin as it is set down: its body and the settled placement ``object_to_plane (4, 4)`` that it is used in."""

    twin_id: str
    body: RigidBody
    object_to_plane: np.ndarray

    @classmethod
    def of(cls, pool: Pool, twin: PoolTwin) -> Placeable:
        """Take the most probable settled placement, an upright one where there is one."""
        best = max(twin.poses, key=lambda pose: (pose.upright, pose.probability))
        return cls(twin.twin_id, pool.body(twin.twin_id).body, best.object_to_plane)

    @cached_property
    def footprint(self) -> np.ndarray:
        """The corners ``(K, 2)`` of what it covers of the plane, in the placement's frame."""
        return footprint(transform_points(self.object_to_plane, np.concatenate(self.body.hulls)))

    def at(self, plane_to_world: np.ndarray) -> np.ndarray:
        """Return the object's pose where the placement's frame is at a pose."""
        return plane_to_world @ self.object_to_plane

    @classmethod
    def in_pose(cls, pool: Pool, twin: PoolTwin, pose: StandingPose) -> Placeable:
        """Return a twin in one of its settled placements."""
        return cls(twin.twin_id, pool.body(twin.twin_id).body, pose.object_to_plane)


@dataclass(frozen=True)
class PickPlaceTask:
    """Objects at rest, and where one of them is to go: ``objects[target]`` to ``goal_object_to_world``."""

    objects: tuple[PlacedObject, ...]
    target: int
    goal_object_to_world: np.ndarray


@dataclass(frozen=True)
class PlacingArea:
    """The area where objects may be put: in a robot's workspace, and wholly on a level surface."""

    workspace: Workspace
    support: SupportRegion

    def wider(self) -> PlacingArea:
        """Return the room for things that nobody has to reach."""
        workspace = self.workspace
        wide = Workspace(
            workspace.min_radius_m,
            workspace.max_radius_m * OTHERS_RADIUS_FACTOR,
            workspace.half_angle_rad * OTHERS_ANGLE_FACTOR,
        )
        return PlacingArea(wide, self.support)

    def beyond(self) -> PlacingArea:
        """Return where an arm may still put something down: wider, and nearer to its base. Planning tells whether it can."""
        workspace = self.wider().workspace
        return PlacingArea(replace(workspace, min_radius_m=workspace.min_radius_m * NEARER_RADIUS_FACTOR), self.support)

    def draw(self, corners: np.ndarray, taken: Sequence[np.ndarray], rng: np.random.Generator) -> np.ndarray | None:
        """Draw a pose for a footprint ``(K, 2)`` that is free of those that are ``taken``; None where none was found."""
        for _ in range(POSES_TRIED):
            pose = _pose(self.workspace, rng)
            if self.holds(_at(corners, pose)) and _clear(_at(corners, pose), taken):
                return pose
        return None

    def reaches(self, position_m: np.ndarray, corners: np.ndarray) -> bool:
        """Tell whether a place ``(2,)`` is in the workspace, and a footprint ``(K, 2)`` there wholly on the surface."""
        workspace, radius_m = self.workspace, float(np.linalg.norm(position_m))
        angle_rad = abs(float(np.arctan2(position_m[1], position_m[0])))
        in_reach = workspace.min_radius_m <= radius_m <= workspace.max_radius_m
        return in_reach and angle_rad <= workspace.half_angle_rad and self.holds(corners)

    def holds(self, corners: np.ndarray) -> bool:
        """Tell whether a footprint ``(K, 2)`` is wholly on the surface, and clear of the arm's foot."""
        inside = np.abs(corners - self.support.center_m) <= self.support.half_extents_m
        # nothing may stand in the arm's foot, whatever its centre's distance
        clear_of_base = np.linalg.norm(corners, axis=1).min() > self.workspace.min_radius_m / 2
        return bool(inside.all() and clear_of_base)


def sample_task(
    target: Placeable, others: Callable[[], Placeable], count: int, area: PlacingArea, rng: np.random.Generator
) -> PickPlaceTask | None:
    """Draw start and goal of a target in a room on the table z = 0, and ``count`` drawn ``others`` around.

    Neither start nor goal is nearer than ``MIN_GAP_M`` to another object. None: no room was found.
    """
    for _ in range(OTHERS_TRIED):
        start = area.draw(target.footprint, [], rng)
        goal = None if start is None else _elsewhere(target.footprint, start[:2, 3], [], area, rng)
        if start is None or goal is None:
            continue
        around = _others(others, count, [_at(target.footprint, pose) for pose in (start, goal)], area.wider(), rng)
        if around is not None:
            first = PlacedObject("object_00", target.twin_id, target.body, target.at(start))
            return PickPlaceTask((first, *around), 0, target.at(goal))
    return None


def sample_objects(
    taking_part: Sequence[Placeable],
    others: Callable[[], Placeable],
    count: int,
    area: PlacingArea,
    rng: np.random.Generator,
) -> tuple[PlacedObject, ...] | None:
    """Draw places in reach for those that take part, and ``count`` drawn ``others`` around; None: there is no room."""
    for _ in range(OTHERS_TRIED):
        taken, placed = list[np.ndarray](), list[PlacedObject]()
        for number, each in enumerate(taking_part):
            pose = area.draw(each.footprint, taken, rng)
            if pose is None:
                break
            taken.append(_at(each.footprint, pose))
            placed.append(PlacedObject(f"object_{number:02d}", each.twin_id, each.body, each.at(pose)))
        if len(placed) < len(taking_part):
            continue
        around = _others(others, count, taken, area.wider(), rng, first=len(placed))
        if around is not None:
            return (*placed, *around)
    return None


def free_goal(
    objects: Sequence[PlacedObject], target: int, area: PlacingArea, rng: np.random.Generator
) -> np.ndarray | None:
    """Draw a free pose for ``objects[target]`` on its surface, turned about Z alone; None: no area."""
    moved = objects[target]
    object_to_plane, corners = on_its_surface(moved, area.support.height_m)
    taken = footprints_of_others(objects, target)
    pose = _elsewhere(corners, moved.object_to_world[:2, 3], taken, area, rng)
    return None if pose is None else pose @ object_to_plane


def on_its_surface(moved: PlacedObject, height_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return an object's pose ``(4, 4)`` turned as it is, above the origin of a level plane at a height, and its footprint."""
    here = moved.object_to_world
    center = transform(translation=np.array([here[0, 3], here[1, 3], 0.0]))
    object_to_plane = inverse(center) @ here
    lowest_m = float(transform_points(here, np.concatenate(moved.body.hulls))[:, 2].min())
    object_to_plane[2, 3] += height_m - lowest_m
    return object_to_plane, footprint_at(moved.body, object_to_plane)


def footprint_at(body: RigidBody, object_to_world: np.ndarray) -> np.ndarray:
    """Return the corners ``(K, 2)`` of what a body covers of the ground at a pose."""
    return footprint(transform_points(object_to_world, np.concatenate(body.hulls)))


def footprints_of_others(objects: Sequence[PlacedObject], target: int) -> list[np.ndarray]:
    """Return the footprints ``(K, 2)`` of all objects but ``objects[target]``, in their order, where they are."""
    return [footprint_at(each.body, each.object_to_world) for number, each in enumerate(objects) if number != target]


def free_poses(
    body: RigidBody,
    object_to_plane: np.ndarray,
    taken: Sequence[np.ndarray],
    area: PlacingArea,
    rng: np.random.Generator,
    *,
    count: int,
) -> Iterator[np.ndarray]:
    """Yield up to ``count`` free poses of a body in a placement ``(4, 4)``, clear of the footprints that are ``taken``."""
    corners = footprint_at(body, object_to_plane)
    for _ in range(count):
        pose = area.draw(corners, taken, rng)
        if pose is None:
            return
        pose[2, 3] += area.support.height_m
        yield pose @ object_to_plane


def _elsewhere(
    corners: np.ndarray, here_m: np.ndarray, taken: Sequence[np.ndarray], area: PlacingArea, rng: np.random.Generator
) -> np.ndarray | None:
    for _ in range(POSES_TRIED):
        pose = area.draw(corners, taken, rng)
        if pose is None or np.linalg.norm(pose[:2, 3] - here_m) >= MIN_MOVE_M:
            return pose
    return None


def _others(
    others: Callable[[], Placeable],
    count: int,
    kept_free: list[np.ndarray],
    area: PlacingArea,
    rng: np.random.Generator,
    first: int = 1,
) -> list[PlacedObject] | None:
    taken, placed = list(kept_free), []
    for number in range(count):
        other = others()
        pose = area.draw(other.footprint, taken, rng)
        if pose is None:
            return None
        taken.append(_at(other.footprint, pose))
        placed.append(PlacedObject(f"object_{number + first:02d}", other.twin_id, other.body, other.at(pose)))
    return placed


def _pose(workspace: Workspace, rng: np.random.Generator) -> np.ndarray:
    radius = np.sqrt(rng.uniform(workspace.min_radius_m**2, workspace.max_radius_m**2))  # even over the area
    angle, yaw = rng.uniform(-workspace.half_angle_rad, workspace.half_angle_rad), rng.uniform(-np.pi, np.pi)
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]])
    return transform(turn, np.array([radius * np.cos(angle), radius * np.sin(angle), 0.0]))


def _at(corners: np.ndarray, pose: np.ndarray) -> np.ndarray:
    return corners @ pose[:2, :2].T + pose[:2, 3]


def _clear(corners: np.ndarray, taken: Sequence[np.ndarray]) -> bool:
    return all(separation_m(corners, other) >= MIN_GAP_M for other in taken)
