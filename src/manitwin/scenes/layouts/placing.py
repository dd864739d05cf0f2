"""Put an object on a surface so that nothing is nearer to it than the gap: by circles first, then by true hull distance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.geometry.hull_distance import ConvexParts, PlacedParts, is_clear_of
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import StaticBox
from manitwin.scenes.layouts.clutter import Patch
from manitwin.scenes.layouts.pool import PoolBody, StandingPose
from manitwin.scenes.layouts.slots import Put
from manitwin.scenes.scene import SupportRegion

GROW_AFTER = 20  # places tried in vain in one patch


class Obstacles:
    """What an object on a support must keep away from: other objects, and furniture that rises above the support."""

    def __init__(self, boxes: Sequence[StaticBox], objects: Sequence[PlacedParts]):
        self.boxes = [ConvexParts.of_box(box).at(box.box_to_world) for box in boxes]
        self.objects = list(objects)

    def above(self, height_m: float) -> list[PlacedParts]:
        """Return the objects and the boxes that reach above a height."""
        return [box for box in self.boxes if box.bounds[1][2] > height_m + 1e-6] + self.objects

    def is_clear(self, parts: PlacedParts, height_m: float, gap_m: float) -> bool:
        """Tell whether nothing above the height is nearer than the gap."""
        return is_clear_of(parts, self.above(height_m), gap_m)


def draw_pose(poses: Sequence[StandingPose], rng: np.random.Generator) -> StandingPose:
    """Draw one of a twin's placements by their probabilities."""
    weights = np.array([pose.probability for pose in poses])
    weights = weights / weights.sum() if weights.sum() > 0 else np.full(len(weights), 1 / len(weights))
    return poses[int(rng.choice(len(weights), p=weights))]


def put_on_surface(
    body: PoolBody, poses: Sequence[StandingPose], patch: Patch, obstacles: Obstacles, *, gap_m: float, tries: int,
    rng: np.random.Generator,
) -> Put | None:  # fmt: skip
    """Return where a twin has room in a patch in one of these placements, or None after so many places.

    The centre of its circle is drawn in the patch, its heading is uniform. Its hulls stay within the support.
    """
    for number in range(tries):
        if number % GROW_AFTER == GROW_AFTER - 1:
            patch.grow()
        stands = draw_pose(poses, rng)
        position = patch.position(rng)
        if position is None:
            patch.grow()
            continue
        object_to_world = on_plane(stands, position, patch.support.height_m, rng.uniform(-np.pi, np.pi))
        parts = body.parts.at(object_to_world)
        if is_within(parts, patch.support) and obstacles.is_clear(parts, patch.support.height_m, gap_m):
            return Put(patch.support.name, stands.placement, parts)
    return None


def on_plane(pose: StandingPose, position_m: np.ndarray, height_m: float, heading_rad: float) -> np.ndarray:
    """Return ``object_to_world`` of a placement on the plane at a height, its circle's centre at a position ``(2,)``."""
    turn = Rotation.from_rotvec([0, 0, heading_rad]).as_matrix()
    plane_to_world = transform(turn, np.array([*position_m, height_m]))
    result: np.ndarray = plane_to_world @ pose.object_to_plane
    return result


def is_within(parts: PlacedParts, support: SupportRegion) -> bool:
    """Tell whether a body's projection lies on a support."""
    low, high = parts.bounds
    center, half = np.array(support.center_m), np.array(support.half_extents_m)
    return bool((low[:2] >= center - half).all() and (high[:2] <= center + half).all())
