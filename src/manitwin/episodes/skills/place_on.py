"""Skills ``place_on`` and ``stack``: set an object down on another one, where a simulated drop shows that it stays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.skills.drop_test import all_drops_succeed, perturbed_poses, rest_after_drop
from manitwin.episodes.skills.skill import Skill, Surroundings
from manitwin.geometry.hull_distance import PlacedParts
from manitwin.geometry.poses import rotation_angle_rad, transform, transform_points
from manitwin.scenes.layouts.placing import pose_on_plane, sample_pose
from manitwin.scenes.layouts.pool import Pool, PoolBody, PoolTwin
from manitwin.scenes.layouts.stacking import LevelFace, level_end, lower_to_contact

AS_IT_IS_TRIED, DRAWN_TRIED = 2, 8
ABOVE_M, RAISED_M = 0.001, 0.02
MOST_MOVED_M, MOST_TURNED_RAD = 0.008, np.radians(6)
LEVEL_M = 0.006  # vertices within this of the highest form the top: scans of boxes are not level to the millimetre
BROAD_M = 0.012  # distance of a top's centre from its edges
SPREAD_SHARE = 0.4  # share of that distance by which placements vary around the centre


@dataclass(frozen=True)
class PlaceOn(Skill):
    """Set the target down on its partner; ``same_category``: only on an object of the same category (``stack``)."""

    name: str
    same_category: bool = False
    predicate: str = "on"
    has_partner: bool = True
    most_poses: int = 4 + AS_IT_IS_TRIED

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept a partner with a level top that is not a vessel; a drop test later decides whether the target stays."""
        if partner is None or partner.vessel or (self.same_category and partner.category != target.category):
            return False
        best = max(partner.poses, key=lambda pose: (pose.upright, pose.probability))
        return _top(pool.body(partner.twin_id).parts.at(best.object_to_plane)) is not None

    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield poses in which the target comes to rest on its partner after a drop of a millimetre, also with perturbations.

        Poses in the target's present orientation come first: a cup put on a box is not expected to lie on its side.
        """
        assert partner is not None
        body, goal = around.body(target), self.goal(around.objects[target], around.objects[partner])
        high, top = around.parts(partner).bounds[1], _top(around.parts(partner))
        if top is None:
            return
        spread_m = SPREAD_SHARE * top.depth_inside(top.middle_m)
        for number in range(AS_IT_IS_TRIED + DRAWN_TRIED):
            if number < AS_IT_IS_TRIED:
                pose = _with_random_heading(body, around.objects[target].object_to_world, rng)
            else:
                pose = pose_on_plane(
                    sample_pose(around.twin(target).poses, rng), np.zeros(2), 0.0, rng.uniform(-np.pi, np.pi)
                )
            center = transform_points(pose, body.body.center_of_mass_m[None])[0, :2]
            shift = top.middle_m - center + (0.0 if number == 0 else rng.uniform(-spread_m, spread_m, 2))
            raised = transform(translation=np.array([*shift, high[2] + RAISED_M])) @ pose
            start = self._release_pose(around, target, partner, raised)
            rested = None if start is None else rest_after_drop(around, target, partner, goal, start)
            if start is None or rested is None or not _is_unmoved(body, start, rested):
                continue
            again = (_raised(each) for each in perturbed_poses(rested, rng))
            beside = (self._release_pose(around, target, partner, each) for each in again)
            if all(each is not None and all_drops_succeed(around, target, partner, goal, [each]) for each in beside):
                yield rested

    def _release_pose(self, around: Surroundings, target: int, partner: int, raised: np.ndarray) -> np.ndarray | None:
        """Return the pose a millimetre above the partner, straight below ``raised``; None if that misses the partner."""
        low_m = float(around.parts(partner).bounds[0][2])
        lowered = lower_to_contact(around.body(target), raised, [around.parts(partner)], low_m)
        if lowered is None or lowered.bounds[0][2] < low_m + ABOVE_M:
            return None
        return transform(translation=np.array([0.0, 0, ABOVE_M])) @ lowered.pose


PLACE_ON, STACK = PlaceOn("place_on"), PlaceOn("stack", same_category=True)


def _raised(pose: np.ndarray) -> np.ndarray:
    return transform(translation=np.array([0.0, 0, RAISED_M])) @ pose


def _with_random_heading(body: PoolBody, object_to_world: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return a pose with the same tilt and random heading, with the lowest point at z = 0."""
    turned = transform(Rotation.from_rotvec([0, 0, rng.uniform(-np.pi, np.pi)]).as_matrix() @ object_to_world[:3, :3])
    turned[2, 3] = -body.parts.at(turned).bounds[0][2]
    return turned


def _top(base: PlacedParts) -> LevelFace | None:
    """Return the level top of an object that can support another one, excluding rims; None if there is none."""
    top = level_end(base, top=True, within_m=LEVEL_M)
    return top if top is not None and top.depth_inside(top.middle_m) >= BROAD_M else None


def _is_unmoved(body: PoolBody, start: np.ndarray, end: np.ndarray) -> bool:
    """Tell whether an object rests as it was released: where it slid or toppled first, a placement is difficult."""
    center = body.body.center_of_mass_m[None]
    moved_m = float(np.linalg.norm(transform_points(end, center) - transform_points(start, center)))
    return moved_m <= MOST_MOVED_M and rotation_angle_rad(end[:3, :3] @ start[:3, :3].T) <= MOST_TURNED_RAD
