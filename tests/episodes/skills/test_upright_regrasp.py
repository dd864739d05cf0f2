"""Standing up a bar for which no grasp serves both start and goal: it is put down on its end, and taken anew."""

from __future__ import annotations

import numpy as np
import pytest
from brick_episodes import TABLE, panda
from held_skills import AREA

from manitwin.episodes.episode import run_episode
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.episodes_run import twins_for
from manitwin.episodes.planning.problem import Grasp, PickPlaceProblem
from manitwin.episodes.room_for_hand import start_placements_with_room
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.registry import SKILLS
from manitwin.episodes.skills.skill import Skill, Surroundings
from manitwin.errors import UsageError
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose
from rigid_boxes import box
from twin_folders import twin_id

LONG_M, WIDE_M = 0.13, 0.05
Y_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
X_UP = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])
BODY = box([LONG_M, WIDE_M, WIDE_M], 0.2, 0.6)
PLACEMENTS = (
    StandingPose(0, transform(None, np.array([0, 0, WIDE_M / 2])), 0.4, 0.05, upright=True),
    StandingPose(1, transform(Y_UP, np.array([0, 0, WIDE_M / 2])), 0.4, 0.05),
    StandingPose(2, transform(X_UP, np.array([0, 0, LONG_M / 2])), 0.2, 0.05),
)


def grasp(name: str, approach: list[float], closing: list[float]) -> Grasp:
    """A grasp near the bar's +X end, of which a hand beside the bar is 11 cm above the table when that end is up."""
    along, across = np.array(approach), np.array(closing)
    rotation = np.column_stack([across, np.cross(along, across), along])
    tip_depth_m = panda()[0].gripper.tip_depth_m
    return Grasp(name, transform(rotation, np.array([0.045, 0, 0]) - tip_depth_m * along), WIDE_M)


FROM_Y, FROM_Z = grasp("from +Y", [0, -1, 0], [0, 0, 1]), grasp("from +Z", [0, 0, -1], [0, 1, 0])


def stood_up(*placements: StandingPose) -> EpisodeFacts:
    twin = PoolTwin(twin_id(0), "0", "bar", placements, False, ())
    lying = PlacedObject(
        "object_00", twin.twin_id, BODY, transform(translation=np.array([0.45, 0.1, 0])) @ PLACEMENTS[1].object_to_plane
    )
    around = Surroundings((lying,), Pool([twin], lambda _: BODY), AREA, (TABLE,))
    goal = SKILLS["upright"].sample_goal(around, 0, None, np.random.default_rng(2))
    assert goal is not None
    robot, planner = panda()
    asked = PickPlaceProblem(lying, goal.poses[0], (FROM_Y, FROM_Z), (), around.boxes, seed=3)
    return run_episode(asked, planner, robot, EpisodeSettings(), goal)[0]


def test_a_bar_is_put_down_on_its_end_and_taken_anew() -> None:
    facts = stood_up(*PLACEMENTS)
    assert facts.outcome == "kept", (facts.evaluation, facts.plan_failures, facts.replans, facts.unplanned)
    assert facts.replans["put_down"] == 1
    assert facts.grasp is not None
    assert facts.grasp.grasp_id == "from +Z"


def test_without_another_placement_there_is_no_plan() -> None:
    assert stood_up(*PLACEMENTS[:2]).outcome == "no_plan"


def test_the_ways_are_placements_in_which_it_does_not_stand() -> None:
    twin = PoolTwin(twin_id(0), "0", "bar", PLACEMENTS, False, ())
    lying = PlacedObject("object_00", twin.twin_id, BODY, PLACEMENTS[1].object_to_plane)
    around = Surroundings((lying,), Pool([twin], lambda _: BODY), AREA, (TABLE,))
    goals = [SKILLS["upright"].sample_goal(around, 0, None, np.random.default_rng(5)) for _ in range(2)]
    first, second = (list(goal.ways) for goal in goals if goal is not None and goal.ways is not None)
    assert len(first) == len(second) > 4
    assert all(np.array_equal(one, other) for one, other in zip(first, second, strict=True))
    assert all(abs(pose[2, 2]) < 1e-6 for pose in first)


def test_episodes_are_only_of_twins_that_a_grasp_brings_there() -> None:
    twins = [PoolTwin(twin_id(n), "0", "bar", PLACEMENTS, False, ()) for n in (0, 1)]
    pool, upright = Pool(twins, lambda _: BODY), SKILLS["upright"]

    def begins(skill: Skill, twin: PoolTwin) -> list[StandingPose]:
        grasps = (FROM_Y, FROM_Z) if twin is twins[1] else (FROM_Y,)
        ends, gripper = skill.ends_in(twin), panda()[0].gripper
        return start_placements_with_room(skill.begins_in(twin), ends, twin.poses, grasps, gripper, BODY)

    assert twins_for(upright, pool, begins) == [twins[1].twin_id]
    with pytest.raises(UsageError, match="can be used to upright"):
        twins_for(upright, pool, lambda skill, twin: [])


@pytest.mark.parametrize(("sizes_m", "vessel", "suits"), [
    ([0.2, 0.15, 0.03], False, False),
    ([0.3, 0.11, 0.03], False, False),
    ([0.3, 0.3, 0.07], True, True),
    ([0.11, 0.05, 0.13], False, True),
])  # fmt: skip
def test_a_book_that_is_laid_flat_is_not_stood_up(sizes_m: list[float], vessel: bool, suits: bool) -> None:
    twin = PoolTwin(twin_id(0), "0", "thing", PLACEMENTS, vessel, ())
    pool = Pool([twin], lambda _: box(sizes_m, 0.2, 0.6))
    assert SKILLS["upright"].suits(pool, twin, None) is suits
