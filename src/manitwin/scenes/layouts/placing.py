"""Placement of objects on a surface: positions in a patch with the density of the clutter level, checked by hull distances."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.geometry.hull_distance import ConvexParts, PlacedParts, is_clear_of
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import StaticBox
from manitwin.robots.robot import Workspace
from manitwin.scenes.layouts.pool import PoolBody, StandingPose
from manitwin.scenes.layouts.slots import SupportedPose
from manitwin.scenes.scene import SupportRegion
from manitwin.scenes.settings import LayoutSettings

GROWTH = 1.25  # of a patch's radius when it has no room left

GROW_AFTER = 20  # failed positions in one patch


@dataclass(frozen=True)
class Clutter:
    """A clutter level: the share of the patch covered by the objects' collision circles, and the least gap between hulls.

    Collision circles of lying objects may overlap without contact of their hulls, so that the share may exceed what discs can
    cover.
    """

    coverage: float
    min_gap_m: float


LEVELS = {"sparse": Clutter(0.12, 0.03), "medium": Clutter(0.3, 0.01), "dense": Clutter(0.7, 0.003)}


def clutter_of(settings: LayoutSettings) -> Clutter:
    """Return the clutter level of the settings, with their own gap if they state one."""
    level = LEVELS[settings.clutter]
    return level if settings.min_gap_m is None else Clutter(level.coverage, settings.min_gap_m)


@dataclass
class Patch:
    """A disc on a support from which positions are drawn; it grows when there is no room left."""

    support: SupportRegion
    workspace: Workspace | None
    center_m: np.ndarray
    radius_m: float

    @classmethod
    def draw(
        cls,
        support: SupportRegion,
        workspace: Workspace | None,
        radii_m: Iterable[float],
        level: Clutter,
        rng: np.random.Generator,
    ) -> Patch | None:
        """Return a patch for objects with these radii; None if the workspace does not contain any of the support."""
        area = sum(np.pi * radius**2 for radius in radii_m) / level.coverage
        patch = cls(support, workspace, np.array(support.center_m), float("inf"))
        center = patch.position(rng)
        return None if center is None else cls(support, workspace, center, float(np.sqrt(area / np.pi)))

    def position(self, rng: np.random.Generator, tries: int = 200) -> np.ndarray | None:
        """Draw a position ``(2,)`` on the support, in the disc and the workspace; None if none is found."""
        center, half = np.array(self.support.center_m), np.array(self.support.half_extents_m)
        low, high = (
            np.maximum(center - half, self.center_m - self.radius_m),
            np.minimum(center + half, self.center_m + self.radius_m),
        )
        drawn = rng.uniform(low, high, (tries, 2))
        fine = np.linalg.norm(drawn - self.center_m, axis=1) <= self.radius_m
        fine &= in_workspace(drawn, self.workspace)
        return drawn[int(fine.argmax())] if fine.any() else None

    def grow(self) -> None:
        """Enlarge the disc."""
        self.radius_m *= GROWTH


def in_workspace(points: np.ndarray, workspace: Workspace | None) -> np.ndarray:
    """Return which points ``(N, 2)`` a robot at the origin reaches from above; all without a workspace."""
    if workspace is None:
        return np.ones(len(points), dtype=bool)
    radius, angle = np.linalg.norm(points, axis=1), np.abs(np.arctan2(points[:, 1], points[:, 0]))
    near_enough = (radius >= workspace.min_radius_m) & (radius <= workspace.max_radius_m)
    result: np.ndarray = near_enough & (angle <= workspace.half_angle_rad)
    return result


def workspace_of(settings: LayoutSettings) -> Workspace | None:
    """Return the workspace of the settings: its numbers, else that of the named robot.

    Raises UsageError for an unknown robot, Unavailable if it needs the packages of ``manitwin[robots]``.
    """
    if settings.workspace is not None:
        near, far, half_deg = settings.workspace
        return Workspace(near, far, float(np.radians(half_deg)))
    if settings.robot is None:
        return None
    from manitwin.robots.load import load_robot

    return load_robot(settings.robot).workspace


class Obstacles:
    """The obstacles of an object on a support: other objects, and furniture that rises above the support."""

    def __init__(self, boxes: Sequence[StaticBox], objects: Sequence[PlacedParts]):
        self.boxes = [ConvexParts.of_box(box).at(box.box_to_world) for box in boxes]
        self.objects = list(objects)

    def above(self, height_m: float) -> list[PlacedParts]:
        """Return the objects, and the boxes that reach above a height."""
        return [box for box in self.boxes if box.bounds[1][2] > height_m + 1e-6] + self.objects

    def is_clear(self, parts: PlacedParts, height_m: float, gap_m: float) -> bool:
        """Return whether every obstacle above the height is at least the gap away."""
        return is_clear_of(parts, self.above(height_m), gap_m)


def sample_pose(poses: Sequence[StandingPose], rng: np.random.Generator) -> StandingPose:
    """Draw one of a twin's placements by their probabilities."""
    weights = np.array([pose.probability for pose in poses])
    weights = weights / weights.sum() if weights.sum() > 0 else np.full(len(weights), 1 / len(weights))
    return poses[int(rng.choice(len(weights), p=weights))]


def place_on_surface(
    body: PoolBody, poses: Sequence[StandingPose], patch: Patch, obstacles: Obstacles, *, gap_m: float, tries: int,
    rng: np.random.Generator,
) -> SupportedPose | None:  # fmt: skip
    """Return a free pose of a twin in a patch, in one of these placements, or None after ``tries`` positions.

    The centre of its collision circle is drawn in the patch, its heading uniformly. Its hulls stay within the support.
    """
    for number in range(tries):
        if number % GROW_AFTER == GROW_AFTER - 1:
            patch.grow()
        stands = sample_pose(poses, rng)
        position = patch.position(rng)
        if position is None:
            patch.grow()
            continue
        object_to_world = pose_on_plane(stands, position, patch.support.height_m, rng.uniform(-np.pi, np.pi))
        parts = body.parts.at(object_to_world)
        if is_within(parts, patch.support) and obstacles.is_clear(parts, patch.support.height_m, gap_m):
            return SupportedPose(patch.support.name, stands.placement, parts)
    return None


def pose_on_plane(pose: StandingPose, position_m: np.ndarray, height_m: float, heading_rad: float) -> np.ndarray:
    """Return ``object_to_world`` of a placement on the plane at a height, with its circle's centre at a position ``(2,)``."""
    turn = Rotation.from_rotvec([0, 0, heading_rad]).as_matrix()
    plane_to_world = transform(turn, np.array([*position_m, height_m]))
    result: np.ndarray = plane_to_world @ pose.object_to_plane
    return result


def is_within(parts: PlacedParts, support: SupportRegion) -> bool:
    """Return whether a body's projection lies on a support."""
    low, high = parts.bounds
    center, half = np.array(support.center_m), np.array(support.half_extents_m)
    return bool((low[:2] >= center - half).all() and (high[:2] <= center + half).all())
