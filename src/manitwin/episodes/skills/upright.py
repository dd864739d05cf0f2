"""``upright``: stand a lying object up, at once or by way of another placement."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import cycle, islice

import numpy as np

from manitwin.episodes.goals.spatial import UPRIGHT_RAD
from manitwin.episodes.pick_place_tasks import footprints_of_others, free_poses
from manitwin.episodes.skills.skill import FoundPoses, Skill, SkillGoal, Surroundings
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose

POSES, WAYS = 12, 12
LEAST_HEIGHT = 0.35
"""A thing that is no vessel stands where it is so high, in its longest extent: of what lies as it is made, +Z up, a hammer and a
book have 0.1 and a flashlight 0.3; of what stands, a shoe has 0.4."""


class Upright(Skill):
    """Set the target down in an upright placement; it begins in one that is not."""

    name, predicate, has_partner = "upright", "upright", False

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept a twin that stands, and that also stays in some other placement.

        A book that is laid flat again has not been stood up: what is low with +Z up takes no part.
        """
        return bool(standing_poses(target)) and bool(lying_poses(target)) and is_high(pool, target)

    def begins_in(self, target: PoolTwin) -> Sequence[StandingPose]:
        """Return the placements on its side."""
        return lying_poses(target)

    def ends_in(self, target: PoolTwin) -> Sequence[StandingPose]:
        """Return the upright placements."""
        return standing_poses(target)

    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield free upright poses in reach."""
        placements = standing_poses(around.twin(target))
        drawn = (placements[int(rng.integers(len(placements)))] for _ in range(POSES))
        yield from _free(around, target, drawn, rng)

    def set_goal(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> SkillGoal | None:
        """Return the goal with free poses on the way: in each of the placements in which the target does not stand, in turn."""
        found, own = super().set_goal(around, target, partner, rng), np.random.default_rng(rng.integers(2**63))
        if found is None:
            return None
        standing = standing_poses(around.twin(target))
        others = [each for each in around.twin(target).poses if each not in standing]
        return replace(found, ways=FoundPoses(_free(around, target, islice(cycle(others), WAYS), own)))


def _free(
    around: Surroundings, target: int, placements: Iterable[StandingPose], rng: np.random.Generator
) -> Iterator[np.ndarray]:
    """Yield a free pose in reach for each of some placements, as far as there is one."""
    taken = footprints_of_others(around.objects, target)
    for placement in placements:
        yield from free_poses(around.objects[target].body, placement.object_to_plane, taken, around.area, rng, count=1)


def standing_poses(twin: PoolTwin) -> list[StandingPose]:
    """Return the placements in which a twin's up (+Z of its frame) is the world's."""
    return [pose for pose in twin.poses if pose.object_to_plane[2, 2] >= np.cos(UPRIGHT_RAD)]


def is_high(pool: Pool, twin: PoolTwin) -> bool:
    """Tell whether a person would say of a twin whose +Z is up that it stands: a vessel, and what is high enough."""
    low, high = pool.body(twin.twin_id).parts.at(np.eye(4)).bounds
    return twin.vessel or bool((high - low)[2] >= LEAST_HEIGHT * (high - low).max())


def lying_poses(twin: PoolTwin) -> list[StandingPose]:
    """Return the placements in which a twin is on its side."""
    return [pose for pose in twin.poses if abs(pose.object_to_plane[2, 2]) < np.sin(np.radians(30))]
