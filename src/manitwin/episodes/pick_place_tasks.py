"""Sampling of pick-and-place tasks: random starts and goals on a table in front of a robot, optionally with other objects."""

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
"""Least distance from start to goal, as in the episodes of docs/measured/robot_data.md."""
MIN_GAP_M = 0.03
"""Clearance between the footprints of two objects: room for a finger."""
OTHERS_RADIUS_FACTOR = 1.2
OTHERS_ANGLE_FACTOR = 1.4
"""Factors of the workspace for other objects: beyond the arm's reach they obstruct nothing."""
NEARER_RADIUS_FACTOR = 0.75
"""Factor of the workspace's inner radius down to which an arm may still put an object down."""
POSES_TRIED, OTHERS_TRIED = 200, 20


@dataclass(frozen=True)
class Placeable:
    """A twin to be placed: its body and the stable placement used, ``object_to_plane (4, 4)``."""

    twin_id: str
    body: RigidBody
    object_to_plane: np.ndarray

    @classmethod
    def in_likeliest_placement(cls, pool: Pool, twin: PoolTwin) -> Placeable:
        """Use the most probable stable placement, preferably an upright one."""
        best = max(twin.poses, key=lambda pose: (pose.upright, pose.probability))
        return cls(twin.twin_id, pool.body(twin.twin_id).body, best.object_to_plane)

    @cached_property
    def footprint(self) -> np.ndarray:
        """Vertices ``(K, 2)`` of its footprint on the plane, in the placement's frame."""
        return footprint(transform_points(self.object_to_plane, np.concatenate(self.body.hulls)))

    def pose_at(self, plane_to_world: np.ndarray) -> np.ndarray:
        """Return the object's pose for a pose ``(4, 4)`` of the placement's frame."""
        return plane_to_world @ self.object_to_plane

    @classmethod
    def in_placement(cls, pool: Pool, twin: PoolTwin, pose: StandingPose) -> Placeable:
        """Use the given stable placement."""
        return cls(twin.twin_id, pool.body(twin.twin_id).body, pose.object_to_plane)


@dataclass(frozen=True)
class PickPlaceTask:
    """Objects at rest, of which ``objects[target]`` is to be moved to ``goal_object_to_world``."""

    objects: tuple[PlacedObject, ...]
    target: int
    goal_object_to_world: np.ndarray

    @property
    def start_and_goal_m(self) -> tuple[np.ndarray, np.ndarray]:
        """Where the target's centre of mass is at the beginning and at the goal, ``(3,)`` each: what a person sees move.

        The origin of its frame does not tell: that of a bottle that lies is at an end, and goes another way where it is turned.
        """
        target = self.objects[self.target]
        return target.center_of_mass_m, replace(target, object_to_world=self.goal_object_to_world).center_of_mass_m


@dataclass(frozen=True)
class PlacingArea:
    """Area where objects may be placed: within a robot's workspace, and entirely on a level surface."""

    workspace: Workspace
    support: SupportRegion

    def widened(self) -> PlacingArea:
        """Return the larger area for objects that need not be reached."""
        workspace = self.workspace
        wide = Workspace(
            workspace.min_radius_m,
            workspace.max_radius_m * OTHERS_RADIUS_FACTOR,
            workspace.half_angle_rad * OTHERS_ANGLE_FACTOR,
        )
        return PlacingArea(wide, self.support)

    def extended(self) -> PlacingArea:
        """Return the area where an arm may be able to put an object down: wider, and closer to its base; planning decides."""
        workspace = self.widened().workspace
        return PlacingArea(replace(workspace, min_radius_m=workspace.min_radius_m * NEARER_RADIUS_FACTOR), self.support)

    def sample_pose(
        self, corners: np.ndarray, taken: Sequence[np.ndarray], rng: np.random.Generator
    ) -> np.ndarray | None:
        """Sample a pose for a footprint ``(K, 2)`` that is clear of the ``taken`` ones; None if none was found."""
        for _ in range(POSES_TRIED):
            pose = _pose(self.workspace, rng)
            if self.contains_footprint(_at(corners, pose)) and _clear(_at(corners, pose), taken):
                return pose
        return None

    def is_reachable(self, position_m: np.ndarray, corners: np.ndarray) -> bool:
        """Tell whether a position ``(2,)`` is in the workspace, and a footprint ``(K, 2)`` entirely on the surface."""
        workspace, radius_m = self.workspace, float(np.linalg.norm(position_m))
        angle_rad = abs(float(np.arctan2(position_m[1], position_m[0])))
        in_reach = workspace.min_radius_m <= radius_m <= workspace.max_radius_m
        return in_reach and angle_rad <= workspace.half_angle_rad and self.contains_footprint(corners)

    def contains_footprint(self, corners: np.ndarray) -> bool:
        """Tell whether a footprint ``(K, 2)`` is entirely on the surface, and clear of the arm's base."""
        inside = np.abs(corners - self.support.center_m) <= self.support.half_extents_m
        # no vertex may overlap the arm's base, whatever the distance of the object's centre
        clear_of_base = np.linalg.norm(corners, axis=1).min() > self.workspace.min_radius_m / 2
        return bool(inside.all() and clear_of_base)


def sample_task(
    target: Placeable, others: Callable[[], Placeable], count: int, area: PlacingArea, rng: np.random.Generator
) -> PickPlaceTask | None:
    """Sample start and goal of a target on the table z = 0, and ``count`` other objects around; None if there is no room.

    Neither start nor goal is closer than ``MIN_GAP_M`` to another object.
    """
    for _ in range(OTHERS_TRIED):
        start = area.sample_pose(target.footprint, [], rng)
        middle_m = transform_points(target.object_to_plane, target.body.center_of_mass_m[None])[0]
        goal = None if start is None else _elsewhere(target.footprint, middle_m, start, [], area, rng)
        if start is None or goal is None:
            continue
        around = _others(others, count, [_at(target.footprint, pose) for pose in (start, goal)], area.widened(), rng)
        if around is not None:
            first = PlacedObject("object_00", target.twin_id, target.body, target.pose_at(start))
            return PickPlaceTask((first, *around), 0, target.pose_at(goal))
    return None


def sample_objects(
    taking_part: Sequence[Placeable],
    others: Callable[[], Placeable],
    count: int,
    area: PlacingArea,
    rng: np.random.Generator,
) -> tuple[PlacedObject, ...] | None:
    """Sample reachable places for the participants, and ``count`` other objects around; None if there is no room."""
    for _ in range(OTHERS_TRIED):
        taken, placed = list[np.ndarray](), list[PlacedObject]()
        for number, each in enumerate(taking_part):
            pose = area.sample_pose(each.footprint, taken, rng)
            if pose is None:
                break
            taken.append(_at(each.footprint, pose))
            placed.append(PlacedObject(f"object_{number:02d}", each.twin_id, each.body, each.pose_at(pose)))
        if len(placed) < len(taking_part):
            continue
        around = _others(others, count, taken, area.widened(), rng, first=len(placed))
        if around is not None:
            return (*placed, *around)
    return None


def free_goal(
    objects: Sequence[PlacedObject], target: int, area: PlacingArea, rng: np.random.Generator
) -> np.ndarray | None:
    """Sample a free pose for ``objects[target]`` on its surface with another heading; None if there is no room."""
    moved = objects[target]
    object_to_plane, corners = on_its_surface(moved, area.support.height_m)
    taken = footprints_of_others(objects, target)
    here = transform(translation=moved.center_of_mass_m * (1, 1, 0))
    pose = _elsewhere(corners, np.zeros(3), here, taken, area, rng)
    return None if pose is None else pose @ object_to_plane


def on_its_surface(moved: PlacedObject, height_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return an object's pose ``(4, 4)`` in its orientation on a level plane at ``height_m``, and its footprint.

    The centre of mass is above the plane's origin, because the frame's origin of a lying bottle is at one end.
    """
    here = moved.object_to_world
    center = transform(translation=moved.center_of_mass_m * (1, 1, 0))
    object_to_plane = inverse(center) @ here
    lowest_m = float(transform_points(here, np.concatenate(moved.body.hulls))[:, 2].min())
    object_to_plane[2, 3] += height_m - lowest_m
    return object_to_plane, footprint_at(moved.body, object_to_plane)


def footprint_at(body: RigidBody, object_to_world: np.ndarray) -> np.ndarray:
    """Return the vertices ``(K, 2)`` of a body's footprint at a pose."""
    return footprint(transform_points(object_to_world, np.concatenate(body.hulls)))


def footprints_of_others(objects: Sequence[PlacedObject], target: int) -> list[np.ndarray]:
    """Return the footprints ``(K, 2)`` of all objects except ``objects[target]``, in order."""
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
    """Yield up to ``count`` free poses of a body in a placement ``(4, 4)``, clear of the ``taken`` footprints."""
    corners = footprint_at(body, object_to_plane)
    for _ in range(count):
        pose = area.sample_pose(corners, taken, rng)
        if pose is None:
            return
        pose[2, 3] += area.support.height_m
        yield pose @ object_to_plane


def _elsewhere(
    corners: np.ndarray,
    middle_m: np.ndarray,
    here: np.ndarray,
    taken: Sequence[np.ndarray],
    area: PlacingArea,
    rng: np.random.Generator,
) -> np.ndarray | None:
    """Draw a free pose in which the middle ``(3,)`` of a footprint, in its own frame, is far enough from where it is ``here``."""
    for _ in range(POSES_TRIED):
        pose = area.sample_pose(corners, taken, rng)
        if pose is None:
            return None
        way_m = transform_points(pose, middle_m[None]) - transform_points(here, middle_m[None])
        if np.linalg.norm(way_m[0, :2]) >= MIN_MOVE_M:
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
        pose = area.sample_pose(other.footprint, taken, rng)
        if pose is None:
            return None
        taken.append(_at(other.footprint, pose))
        placed.append(PlacedObject(f"object_{number + first:02d}", other.twin_id, other.body, other.pose_at(pose)))
    return placed


def _pose(workspace: Workspace, rng: np.random.Generator) -> np.ndarray:
    radius = np.sqrt(rng.uniform(workspace.min_radius_m**2, workspace.max_radius_m**2))  # uniform over the area
    angle, yaw = rng.uniform(-workspace.half_angle_rad, workspace.half_angle_rad), rng.uniform(-np.pi, np.pi)
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]])
    return transform(turn, np.array([radius * np.cos(angle), radius * np.sin(angle), 0.0]))


def _at(corners: np.ndarray, pose: np.ndarray) -> np.ndarray:
    return corners @ pose[:2, :2].T + pose[:2, 3]


def _clear(corners: np.ndarray, taken: Sequence[np.ndarray]) -> bool:
    return all(separation_m(corners, other) >= MIN_GAP_M for other in taken)
