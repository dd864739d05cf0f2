"""Common parts of the skill benchmarks: one robot with the twins of one data set, and their start poses."""

from __future__ import annotations

from collections.abc import Sequence

from manitwin.episodes.attempts import EXECUTION_FAILURES
from manitwin.episodes.pick_place_tasks import Placeable
from manitwin.episodes.room_for_hand import feasible_start_placements
from manitwin.episodes.skills.skill import Skill
from manitwin.episodes.target_grasps import usable_grasps
from manitwin.robots.load import load_robot
from manitwin.scenes.layouts.pool import PoolTwin, StandingPose, cached_pool
from manitwin.twin.loaded_twin import TwinSource

EXECUTED = {"kept", "unplanned_contact", "disturbed", *EXECUTION_FAILURES}


class TwinBench:
    """A robot and the twins of a data set."""

    def __init__(self, dataset: str, robot: str):
        """Read the pool of twins."""
        self.pool, self.source, self.robot = cached_pool(dataset), TwinSource(dataset), load_robot(robot)

    def begins(self, skill: Skill, target: PoolTwin) -> Sequence[StandingPose]:
        """Return the placements from which a target may start with a skill, as far as its grasps and the table determine."""
        return feasible_start_placements(
            skill,
            target,
            self.pool.body(target.twin_id).body,
            lambda: [each.grasp for each in usable_grasps(self.source.twin(target.twin_id), self.robot.gripper)],
            self.robot.gripper,
        )

    def placeable(self, twin: PoolTwin) -> Placeable:
        """Return how a twin may be placed on a table."""
        return Placeable.in_likeliest_placement(self.pool, twin)
