"""Skill ``away_from``: set an object down at a distance from another one that it is near to."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from manitwin.episodes.goals.goal import SIGNATURES
from manitwin.episodes.pick_place_tasks import footprint_at, footprints_of_others, free_poses, on_its_surface
from manitwin.episodes.skills.skill import Skill, Surroundings
from manitwin.geometry.boxes import separation_m
from manitwin.scenes.layouts.pool import Pool, PoolTwin

DRAWN = 200
SPARE_M = 0.02  # beyond the goal's distance, because placements are off by a few millimetres


class AwayFrom(Skill):
    """Set the target down on its surface apart from its partner, near which it starts."""

    name, predicate, has_partner = "away_from", "away_from", True

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept any pair."""
        return partner is not None

    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield free poses in reach, with random heading, whose footprints are far enough from the partner's."""
        assert partner is not None
        moved = around.objects[target]
        least_m = SIGNATURES[self.predicate].default
        assert least_m is not None
        taken = footprints_of_others(around.objects, target)
        apart_from = taken[partner if partner < target else partner - 1]
        object_to_plane, _ = on_its_surface(moved, 0.0)
        for pose in free_poses(moved.body, object_to_plane, taken, around.area, rng, count=DRAWN):
            if separation_m(footprint_at(moved.body, pose), apart_from) >= least_m + SPARE_M:
                yield pose
