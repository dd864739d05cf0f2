"""Skill ``upright``: stand a lying object up, directly or via another placement."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import cycle, islice

import numpy as np

from manitwin.episodes.goals.spatial import UPRIGHT_RAD
from manitwin.episodes.pick_place_tasks import footprints_of_others, free_poses
from manitwin.episodes.skills.skill import LazyPoses, Skill, SkillGoal, Surroundings
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose

POSES, WAYS = 12, 12
LEAST_HEIGHT = 0.35
"""Least height, relative to the longest extent, of a standing object that is not a vessel. With +Z up, lying objects such as
a hammer and a book have 0.1 and a flashlight 0.3; a shoe, which stands, has 0.4.
"""


class Upright(Skill):
    """Set the target down in an upright placement, starting from another one."""

    name, predicate, has_partner = "upright", "upright", False

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept a twin that can stand and also has a stable placement on its side.

        Flat objects are excluded: laying a book flat is not standing it up.
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

    def sample_goal(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> SkillGoal | None:
        """Return the goal with free intermediate poses, cycling through the placements in which the target does not stand."""
        found, own = super().sample_goal(around, target, partner, rng), np.random.default_rng(rng.integers(2**63))
        if found is None:
            return None
        standing = standing_poses(around.twin(target))
        others = [each for each in around.twin(target).poses if each not in standing]
        return replace(found, ways=LazyPoses(_free(around, target, islice(cycle(others), WAYS), own)))


def _free(
    around: Surroundings, target: int, placements: Iterable[StandingPose], rng: np.random.Generator
) -> Iterator[np.ndarray]:
    """Yield a free pose in reach for each placement for which there is one."""
    taken = footprints_of_others(around.objects, target)
    for placement in placements:
        yield from free_poses(around.objects[target].body, placement.object_to_plane, taken, around.area, rng, count=1)


def standing_poses(twin: PoolTwin) -> list[StandingPose]:
    """Return the placements in which a twin's up axis (+Z of its frame) is vertical."""
    return [pose for pose in twin.poses if pose.object_to_plane[2, 2] >= np.cos(UPRIGHT_RAD)]


def is_high(pool: Pool, twin: PoolTwin) -> bool:
    """Tell whether a twin with +Z up is regarded as standing: a vessel, or high enough."""
    low, high = pool.body(twin.twin_id).parts.at(np.eye(4)).bounds
    return twin.vessel or bool((high - low)[2] >= LEAST_HEIGHT * (high - low).max())


def lying_poses(twin: PoolTwin) -> list[StandingPose]:
    """Return the placements in which a twin lies on its side."""
    return [pose for pose in twin.poses if abs(pose.object_to_plane[2, 2]) < np.sin(np.radians(30))]
