"""Skill ``handover``: one arm picks the target, a second one takes it by another grasp and puts it down on its own side."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from manitwin.episodes.skills.skill import Skill, SkillGoal, Surroundings
from manitwin.geometry.poses import transform
from manitwin.scenes.layouts.pool import Pool, PoolTwin

LEAST_LENGTH_M = 0.10  # shorter objects have no room for two hands
LEAST_LIKELY = 0.05  # smallest probability of a placement
SAME = 0.02  # largest coordinate difference between the up directions of placements that count as the same


class Handover(Skill):
    """Hand the target from the first arm to the second; ``courses.handover`` chooses the place once all objects are at rest."""

    name, predicate, has_partner, arms = "handover", "handed_over", False, 2

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept an object at least 10 cm long."""
        points = pool.body(target.twin_id).parts.whole
        return bool(np.ptp(points @ np.linalg.eigh(np.cov(points.T))[1], axis=0).max() >= LEAST_LENGTH_M)

    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield the target's pose, then its other stable placements at the same place, in which it may be put down."""
        here = around.objects[target].object_to_world
        yield here
        for placement in around.twin(target).poses:
            turned = placement.object_to_plane
            if placement.probability >= LEAST_LIKELY and abs(here[2, :3] - turned[2, :3]).max() > SAME:
                yield transform(turned[:3, :3], here[:3, 3])

    def sample_goal(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> SkillGoal | None:
        """Return the goal: handed over, and put down in any of ``poses``."""
        poses = tuple(self.poses(around, target, partner, rng))
        return SkillGoal(self.goal(around.objects[target], None), poses, None, {}, hands_over=True)
