"""Skill ``place_in``: release an object in a vessel, lying or leaning, or on end with its lower end below the rim."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain, zip_longest

import numpy as np

from manitwin.episodes.skills.drop_test import all_drops_succeed, perturbed_poses, rest_after_drop
from manitwin.episodes.skills.skill import Skill, Surroundings, successful_draws
from manitwin.episodes.skills.within_rim import (
    FREE_FALL_M,
    leaning_pose,
    pose_in_orientation,
    pose_on_end,
    radius_on_end,
)
from manitwin.geometry.hull_distance import PlacedParts
from manitwin.geometry.poses import transform, transform_points
from manitwin.scenes.layouts.pool import Pool, PoolTwin
from manitwin.scenes.layouts.stacking import ContainerOpening, container_opening, open_poses, place_in_container

LEAST_DEPTH_M = 0.025  # of a vessel: an object on a plate lies on it, and rolls off
LEANING_FALL_M = 0.004  # release height above where a drop ended
AS_IT_IS_TRIED, LYING_TRIED, ON_END_TRIED, LEANING_TRIED = 3, 4, 12, 12
ROUNDS = 5  # rounds of sampling; the next round is only used if no pose of the previous ones can be planned
RESTS_FIRST = 8  # number of resting poses tried before release poses
FAR_FALL_M = 0.03
"""An object that moves farther while falling meets the opening hand: twice as many drops with twice the perturbation are
tested.
"""


class PlaceIn(Skill):
    """Put the target into its partner, a vessel that opens upwards."""

    name, predicate, has_partner, most_poses = "place_in", "in", True, 32
    lets_fall = True

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept a vessel deeper than a plate, with a rim wider than the target's two smaller sides."""
        if partner is None or not partner.vessel or not open_poses(partner, pool.body(partner.twin_id)):
            return False
        opening = pool.body(partner.twin_id).opening
        if opening is None or opening.depth_m < LEAST_DEPTH_M:
            return False
        return radius_on_end(pool.body(target.twin_id).parts.whole) < opening.rim_radius_m

    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield poses just above where the target would lie or lean, and poses on end with the lower end below the rim.

        Only poses from which the target comes to rest in the vessel in a simulated drop are used, also with perturbations: a
        banana that balances on the rim of a bowl does not qualify. The resting pose of a drop is also a goal pose and comes
        before the release pose: a fork on end in a bowl falls to any side, over the rim or against the hand.

        Lying poses, some in the target's present orientation, alternate with poses on end, those with the least motion first,
        because the hand may collide with the rim for all poses of one kind. For vessels without room for the hand, objects
        are released leaning, tilted from their present orientation, so that a hand that grasped from above stays above the
        rim; or at the rim of a deep vessel, at the poses before the drop.
        """
        assert partner is not None
        mouth = container_opening(around.body(partner), around.objects[partner].object_to_world)
        if mouth is None:
            return
        vessel = around.parts(partner)
        goal = self.goal(around.objects[target], around.objects[partner])

        def steadiest(poses: Iterator[np.ndarray]) -> list[tuple[np.ndarray, np.ndarray]]:
            """Return the raised resting poses and the release poses of drops that reach the goal; smallest motion first."""
            rests = [(begun, rest_after_drop(around, target, partner, goal, begun)) for begun in poses]
            found = [(begun, rest) for begun, rest in rests if rest is not None]
            found.sort(key=lambda each: _farthest_m(around.body(target).parts.whole, *each))
            return [(_raised(rest), begun) for begun, rest in found]

        body, standing = around.body(target), around.objects[target].object_to_world[:3, :3]
        for _ in range(ROUNDS):
            ends = successful_draws(
                lambda: pose_on_end(body, vessel, mouth, rng, deep=bool(rng.random() < 0.5)), ON_END_TRIED
            )
            lying = successful_draws(lambda: _lying(around, target, vessel, mouth, rng), LYING_TRIED)
            as_now = successful_draws(lambda: pose_in_orientation(body, standing, vessel, mouth, rng), AS_IT_IS_TRIED)
            by_turns = zip_longest(steadiest(chain(as_now, lying)), steadiest(ends))
            pairs = [pair for both in by_turns for pair in both if pair is not None]
            yield from self._steady(around, target, partner, [rest for rest, _ in pairs[:RESTS_FIRST]], rng)
            leans = successful_draws(lambda: leaning_pose(body, standing, vessel, mouth, rng), LEANING_TRIED)
            for rest, begun in steadiest(leans):
                yield from self._steady(around, target, partner, [begun, rest], rng)
            for rest, begun in pairs:
                falls_far = _farthest_m(body.parts.whole, begun, rest) > FAR_FALL_M
                yield from self._steady(around, target, partner, [begun], rng, 2 if falls_far else 1)
            yield from self._steady(around, target, partner, [rest for rest, _ in pairs[RESTS_FIRST:]], rng)

    def _steady(
        self,
        around: Surroundings,
        target: int,
        partner: int,
        poses: Sequence[np.ndarray],
        rng: np.random.Generator,
        scale: int = 1,
    ) -> Iterator[np.ndarray]:
        """Yield the poses from which the goal is also reached with perturbations."""
        goal = self.goal(around.objects[target], around.objects[partner])
        for pose in poses:
            if all_drops_succeed(around, target, partner, goal, perturbed_poses(pose, rng, scale)):
                yield pose


def _lying(
    around: Surroundings, target: int, vessel: PlacedParts, mouth: ContainerOpening, rng: np.random.Generator
) -> np.ndarray | None:
    twin = around.twin(target)
    put = place_in_container(twin, around.body(target), around.area.support.name, mouth, [vessel], rng)
    if put is None:
        return None
    pose = put.object_to_world.copy()
    pose[2, 3] += FREE_FALL_M
    return pose


def _raised(rest: np.ndarray) -> np.ndarray:
    return transform(translation=np.array([0.0, 0, LEANING_FALL_M])) @ rest


def _farthest_m(points: np.ndarray, before: np.ndarray, after: np.ndarray) -> float:
    """Return the largest displacement of any point between two poses ``(4, 4)``."""
    return float(np.linalg.norm(transform_points(after, points) - transform_points(before, points), axis=1).max())
