"""``handover``: one arm picks the target, a second one takes it by another grasp, and the first lets go and withdraws."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from manitwin.episodes.skills.skill import Skill, SkillGoal, Surroundings
from manitwin.scenes.layouts.pool import Pool, PoolTwin

LEAST_LENGTH_M = 0.10  # of what has room for two hands


class Handover(Skill):
    """Hand the target over from the first arm to the second; ``courses.handover`` chooses where, once all has come to rest."""

    name, predicate, has_partner, arms = "handover", "handed_over", False, 2

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept what is 10 cm long or more."""
        points = pool.body(target.twin_id).parts.whole
        return bool(np.ptp(points @ np.linalg.eigh(np.cov(points.T))[1], axis=0).max() >= LEAST_LENGTH_M)

    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield where the target is: what counts is who holds it."""
        yield around.objects[target].object_to_world

    def set_goal(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> SkillGoal | None:
        """Return the goal."""
        poses = tuple(self.poses(around, target, partner, rng))
        return SkillGoal(self.goal(around.objects[target], None), poses, None, {}, hands_over=True)
