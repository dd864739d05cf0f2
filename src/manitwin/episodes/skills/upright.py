"""``upright``: stand a lying object up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from manitwin.episodes.goals.spatial import UPRIGHT_RAD
from manitwin.episodes.pick_place_tasks import footprint_at, free_poses
from manitwin.episodes.skills.skill import Skill, Surroundings
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose

POSES = 12


class Upright(Skill):
    """Set the target down in an upright placement; it begins in one that is not."""

    name, predicate, has_partner = "upright", "upright", False

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept a twin that stands, and that also stays in some other placement."""
        return bool(standing_poses(target)) and bool(lying_poses(target))

    def begins_in(self, target: PoolTwin) -> Sequence[StandingPose]:
        """Return the placements on its side."""
        return lying_poses(target)

    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield free upright poses in reach."""
        twin = around.twin(target)
        taken = [
            footprint_at(each.body, each.object_to_world)
            for number, each in enumerate(around.objects)
            if number != target
        ]
        for _ in range(POSES):
            placements = standing_poses(twin)
            chosen = placements[int(rng.integers(len(placements)))]
            yield from free_poses(around.objects[target].body, chosen.object_to_plane, taken, around.area, rng, count=1)


def standing_poses(twin: PoolTwin) -> list[StandingPose]:
    """Return the placements in which a twin's up (+Z of its frame) is the world's."""
    return [pose for pose in twin.poses if pose.object_to_plane[2, 2] >= np.cos(UPRIGHT_RAD)]


def lying_poses(twin: PoolTwin) -> list[StandingPose]:
    """Return the placements in which a twin is on its side."""
    return [pose for pose in twin.poses if abs(pose.object_to_plane[2, 2]) < np.sin(np.radians(30))]
