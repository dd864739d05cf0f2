"""Stacking and containment: an object is lowered onto or into another until near contact, and then settled by physics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from manitwin.geometry.hull_distance import PlacedParts, distance
from manitwin.geometry.poses import rotation_between, transform, transform_points
from manitwin.scenes.layouts.placing import pose_on_plane, sample_pose
from manitwin.scenes.layouts.pool import PoolBody, PoolTwin, StandingPose
from manitwin.scenes.layouts.slots import SupportedPose

ABOVE_M = 0.0005  # gap at which lowering stops, so that the object falls only a little
LOWERING_STEPS = 12
LONGEST_STEP_M = 0.05
LEVEL_M = 0.001  # corners within this distance of the highest form the top, of the lowest the foot
STANDS_M = 0.006  # how far the centre of mass of a stacked object is inside both polygons
BROAD_M = 0.02  # least distance of the middle of a top from its edges, for an object to stand on it
FLAT_M = 0.003  # a stacked object stands this close to the highest point below it
UP_RIGHT = np.cos(np.radians(12))
LEAN_RAD = np.radians(20)  # largest tilt of a long object in a container
RIM_SLACK = 0.95  # share of the rim's radius that an inserted object may take


@dataclass(frozen=True)
class ContainerOpening:
    """A container's opening in the world: the centre of its rim, the rim's radius, and the depth below."""

    center_m: np.ndarray
    radius_m: float
    depth_m: float


def container_opening(body: PoolBody, object_to_world: np.ndarray) -> ContainerOpening | None:
    """Return a container's mouth if it opens upward, else None."""
    opening = body.opening
    if opening is None or float((object_to_world[:3, :3] @ opening.axis)[2]) < UP_RIGHT:
        return None
    center = transform_points(object_to_world, opening.center_m[None])[0]
    return ContainerOpening(center, opening.rim_radius_m, opening.depth_m)


def open_poses(twin: PoolTwin, body: PoolBody) -> list[StandingPose]:
    """Return the placements in which a container opens upward."""
    return [pose for pose in twin.poses if container_opening(body, pose.object_to_plane) is not None]


def level_poses(twin: PoolTwin, body: PoolBody) -> list[StandingPose]:
    """Return the placements of a twin with a level top that can support an object; a container has only a rim."""
    if twin.vessel:
        return []
    return [pose for pose in twin.poses if _is_broad(level_end(body.parts.at(pose.object_to_plane), top=True))]


def _is_broad(level: LevelFace | None) -> bool:
    return level is not None and level.depth_inside(level.middle_m) >= BROAD_M


def place_in_container(
    twin: PoolTwin,
    body: PoolBody,
    surface: str,
    mouth: ContainerOpening,
    obstacles: Sequence[PlacedParts],
    rng: np.random.Generator,
) -> SupportedPose | None:
    """Return a twin lowered into a container, in one of its placements or on end; None if it is wider than the rim."""
    rotation = _turned(
        sample_pose(twin.poses, rng).object_to_plane[:3, :3] if rng.random() < 0.5 else _upended_rotation(body, rng),
        rng,
    )
    points = body.parts.whole @ rotation.T
    middle = (points[:, :2].min(0) + points[:, :2].max(0)) / 2
    spare = RIM_SLACK * mouth.radius_m - float(np.linalg.norm(points[:, :2] - middle, axis=1).max())
    if spare < 0:
        return None
    around, out = rng.uniform(-np.pi, np.pi), spare * np.sqrt(rng.random())
    shift = mouth.center_m[:2] - middle + out * np.array([np.cos(around), np.sin(around)])
    start = mouth.center_m[2] + 0.02 - points[:, 2].min()
    lowered = lower_to_contact(
        body, transform(rotation, np.array([*shift, start])), obstacles, mouth.center_m[2] - 2 * mouth.depth_m
    )
    if lowered is None or lowered.bounds[0][2] > mouth.center_m[2] - mouth.depth_m / 4:
        return None
    return SupportedPose(surface, None, lowered)


def place_on_object(
    twin: PoolTwin,
    body: PoolBody,
    surface: str,
    base: PlacedParts,
    obstacles: Sequence[PlacedParts],
    rng: np.random.Generator,
) -> SupportedPose | None:
    """Return a twin in one of its placements on the level top of another, or None if it would not stand there.

    Its centre of mass is above the top and above its own foot, by ``STANDS_M`` inside both, hence above their intersection.
    """
    pose = sample_pose(twin.poses, rng)
    top = level_end(base, top=True)
    turned = body.parts.at(pose_on_plane(pose, np.zeros(2), 0.0, rng.uniform(-np.pi, np.pi)))
    foot = level_end(turned, top=False)
    center = transform_points(turned.pose, body.body.center_of_mass_m[None])[0, :2]
    if top is None or foot is None or foot.depth_inside(center) < STANDS_M:
        return None
    target = top.middle_m + (top.depth_inside(top.middle_m) - STANDS_M) * rng.uniform(-0.7, 0.7, 2)
    top_m = float(base.bounds[1][2])
    raised = transform(translation=np.array([*(target - center), top_m + 0.02])) @ turned.pose
    lowered = lower_to_contact(body, raised, obstacles, top_m - FLAT_M)
    if lowered is None or lowered.bounds[0][2] < top_m - FLAT_M:
        return None
    return SupportedPose(surface, pose.placement, lowered)


def lower_to_contact(
    body: PoolBody, raised: np.ndarray, obstacles: Sequence[PlacedParts], floor_m: float
) -> PlacedParts | None:
    """Lower a body until it is close to an obstacle; None if it starts in contact or sinks below ``floor_m`` freely.

    Conservative advancement: a body may sink by its distance to the nearest obstacle without contact. The distance left after
    ``LOWERING_STEPS`` is a free fall.
    """
    parts = body.parts.at(raised)
    low, high = parts.bounds
    below = [o for o in obstacles if (o.bounds[0][:2] <= high[:2]).all() and (o.bounds[1][:2] >= low[:2]).all()]
    for number in range(LOWERING_STEPS):
        gap = LONGEST_STEP_M
        for other in below:
            gap = min(gap, distance(parts, other, beyond_m=gap))
        if gap <= 2 * ABOVE_M:
            return parts if number else None
        if parts.bounds[0][2] < floor_m:
            return None
        pose = parts.pose.copy()
        pose[2, 3] -= gap - ABOVE_M
        parts = body.parts.at(pose)
    return parts


@dataclass(frozen=True)
class LevelFace:
    """The level end of a body as a convex polygon from above: its middle, and sides ``normals . x + offsets <= 0``."""

    middle_m: np.ndarray
    normals: np.ndarray
    offsets_m: np.ndarray

    def depth_inside(self, point: np.ndarray) -> float:
        """Return how far (m) inside the polygon a point ``(2,)`` is; negative outside."""
        return -float((self.normals @ point + self.offsets_m).max())


def level_end(parts: PlacedParts, *, top: bool, within_m: float = LEVEL_M) -> LevelFace | None:
    """Return a body's upper or lower end if it is level (within ``within_m``) and ``2 * STANDS_M`` wide about its middle."""
    heights = parts.whole[:, 2] * (1 if top else -1)
    points = parts.whole[heights > heights.max() - within_m][:, :2]
    if len(points) < 3 or np.linalg.matrix_rank(points - points.mean(0), tol=STANDS_M) < 2:
        return None
    polygon = ConvexHull(points)
    middle = points[polygon.vertices].mean(0)
    level = LevelFace(middle, polygon.equations[:, :2], polygon.equations[:, 2])
    return level if level.depth_inside(middle) >= 2 * STANDS_M else None


def _upended_rotation(body: PoolBody, rng: np.random.Generator) -> np.ndarray:
    """Return a rotation that puts the body's longest axis upright, either end up, with a small tilt."""
    spread = np.linalg.eigh(np.cov(body.parts.whole.T))[1]
    longest = spread[:, 2] * (1 if rng.random() < 0.5 else -1)
    lean, around = LEAN_RAD * rng.random(), rng.uniform(-np.pi, np.pi)
    tilt = Rotation.from_rotvec(lean * np.array([np.cos(around), np.sin(around), 0.0])).as_matrix()
    result: np.ndarray = tilt @ rotation_between(longest, np.array([0.0, 0, 1]))
    return result


def _turned(rotation: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    result: np.ndarray = Rotation.from_rotvec([0, 0, rng.uniform(-np.pi, np.pi)]).as_matrix() @ rotation
    return result
