"""Pushing: a box is slid to the mark; to a place 15 cm beside it, or carried there, it is not pushed to the mark."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from brick_episodes import panda
from granular_things import two_things
from held_skills import around

from manitwin.episodes.courses import push as push_course
from manitwin.episodes.courses.course import EpisodeStart
from manitwin.episodes.episode import create_world, run_episode
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.planning.problem import Grasp, PickPlaceProblem
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.push import MARK
from manitwin.episodes.skills.registry import SKILLS
from manitwin.episodes.skills.skill import SkillGoal, Surroundings
from manitwin.episodes.skills.strokes import strokes, touches_near_edge
from manitwin.episodes.tool_watches import PushWatch
from manitwin.geometry.poses import transform, transform_points
from rigid_boxes import above, block, box

BESIDE = np.array([0.0, 0.15, 0.0])
UP = np.array([0.0, 0.0, 0.02])
BOX = replace(box([0.07, 0.1, 0.04], 0.2), hulls=tuple(h + UP for h in box([0.07, 0.1, 0.04], 0.2).hulls))
SPOT = around(replace(BOX, center_of_mass_m=np.array([0.0, 0.01, 0.02])), (), 0.5, 0.05)


def goal_of(surroundings: Surroundings, seed: int) -> SkillGoal:
    goal = SKILLS["push"].sample_goal(surroundings, 0, None, np.random.default_rng(seed))
    assert goal is not None
    return goal


def test_what_is_round_would_roll_and_is_not_pushed() -> None:
    around_m = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    ring = np.column_stack([np.zeros(32), 0.017 * np.sin(around_m), 0.017 + 0.017 * np.cos(around_m)])
    rod = replace(box([0.2, 0.034, 0.034], 0.1), hulls=(np.concatenate([ring, ring + np.array([0.2, 0, 0])]),))
    bar = replace(box([0.2, 0.034, 0.034], 0.1), hulls=(block([0, -0.017, 0], [0.2, 0.017, 0.034]),))
    for body, slides in ((rod, False), (bar, True)):
        spot = around(body, (), 0.5, 0.05)
        assert SKILLS["push"].suits(spot.pool, spot.twin(0), None) == slides


def test_what_the_fingertips_would_pass_over_is_not_pushed_that_way() -> None:
    """A spoon: a bowl of 22 mm at one end, a handle of 7 mm that its middle lies in."""
    spoon = replace(
        box([0.2, 0.04, 0.022], 0.05),
        hulls=(block([-0.1, -0.02, 0], [-0.06, 0.02, 0.022]), block([-0.06, -0.02, 0], [0.1, 0.02, 0.007])),
        center_of_mass_m=np.array([0.0, 0, 0.006]),
    )
    spot = around(spoon, (), 0.5, 0.05)
    for way, meets in (([1.0, 0], True), ([-1.0, 0], False), ([0, 1.0], False)):
        assert touches_near_edge(spot.objects[0], np.array(way)) == meets  # from behind the bowl alone
    assert touches_near_edge(SPOT.objects[0], np.array([0.6, 0.8]))
    for seed in range(4):
        goal = goal_of(spot, seed)
        assert goal.places_m[MARK][0] > 0.5, "away from the bowl"


def test_what_lies_so_that_it_would_roll_is_not_pushed_though_it_could_be_as_it_stands() -> None:
    around_m = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    ring = np.column_stack([0.025 * np.cos(around_m), 0.025 * np.sin(around_m), np.zeros(32)])
    can = replace(box([0.05, 0.05, 0.05], 0.1), hulls=(np.concatenate([ring, ring + np.array([0, 0, 0.05])]),))
    standing = around(can, (), 0.5, 0.05)
    (placed,) = standing.objects
    on_its_side = transform(np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.array([0.5, 0.05, 0.025]))
    lying = replace(standing, objects=(replace(placed, object_to_world=on_its_side),))
    assert SKILLS["push"].suits(standing.pool, standing.twin(0), None)
    assert SKILLS["push"].sample_goal(standing, 0, None, np.random.default_rng(1)) is not None
    assert SKILLS["push"].sample_goal(lying, 0, None, np.random.default_rng(1)) is None


def attempt(goal: SkillGoal, grasps: tuple[Grasp, ...] = ()) -> EpisodeFacts:
    robot, planner = panda()
    problem = PickPlaceProblem(SPOT.objects[0], goal.poses[0], grasps, (), SPOT.boxes, seed=3)
    return run_episode(problem, planner, robot, EpisodeSettings(), goal)[0]


def test_a_box_is_slid_to_the_mark() -> None:
    facts = attempt(goal_of(SPOT, 0))
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned, facts.plan_failures)
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].measured["rise_m"] < 0.002


@pytest.mark.slow
def test_pushed_15_cm_beside_the_mark_it_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    def beside(moved: object, place_m: np.ndarray, tips_m: np.ndarray, level_m: float) -> Sequence[object]:
        return strokes(moved, place_m + BESIDE, tips_m, level_m)  # type: ignore[arg-type]

    monkeypatch.setattr(push_course, "strokes", beside)
    facts = attempt(goal_of(SPOT, 0))
    assert facts.outcome in ("goal_missed", "replan_failed")
    assert facts.evaluation is None or facts.evaluation.literals[0].failure == "beside_it"


def test_what_is_carried_to_the_mark_is_not_pushed_there() -> None:
    goal = goal_of(SPOT, 0)
    way = goal.places_m[MARK] - transform_points(goal.poses[0], SPOT.objects[0].body.center_of_mass_m[None])[0]
    there = transform(None, np.array([*way[:2], 0.001])) @ goal.poses[0]
    facts = attempt(replace(goal, pushes=False, poses=(there,)), (Grasp("g0", above([0, 0, 0.02]), 0.07),))
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure == "not_touched"


def test_a_push_is_watched_at_what_is_pushed_while_another_object_is_taken() -> None:
    pair = two_things((BOX, ()), (BOX, ()), ((0.5, 0.0), (0.5, 0.16)), vessels=(False, False))
    problem = PickPlaceProblem(
        pair.objects[0], pair.objects[0].object_to_world, (), pair.objects[1:], pair.boxes, seed=3
    )
    robot, planner = panda()
    start = EpisodeStart(problem, pair.objects, planner, EpisodeSettings(), goal_of(pair, 0))
    with create_world(problem, robot, EpisodeSettings(), 50.0) as world:
        (watch,) = push_course.PushCourse(start, EpisodeFacts()).watches(world)
        assert isinstance(watch, PushWatch)
        world.set_target(1)
        assert np.allclose(watch.center()[:2], [0.5, 0.01], atol=0.011)
        world.bodies[1].set_linear_velocity(np.array([0, 0, 1.0], np.float32))
        world.step(12)
        assert watch.center()[2] < 0.03 < world.object_to_world(1)[2, 3]


def test_marks_are_in_reach_and_the_way_is_free() -> None:
    crowded = two_things((BOX, ()), (BOX, ()), ((0.5, 0.0), (0.5, 0.16)), vessels=(False, False))
    for seed in range(12):
        place = goal_of(crowded, seed).places_m[MARK]
        assert 0.07 < np.linalg.norm(place[:2] - [0.5, 0.0]) < 0.21
        assert np.linalg.norm(place[:2] - [0.5, 0.16]) > 0.08


def test_only_what_a_fingertip_can_push_without_tipping_it_is_pushed() -> None:
    def suits(extents_m: list[float]) -> bool:
        body = box(extents_m, 0.2)
        spot = around(body, (), 0.5, 0.0)
        return SKILLS["push"].suits(spot.pool, spot.twin(0), None)

    assert suits([0.07, 0.1, 0.04])
    assert not suits([0.07, 0.1, 0.01])
    assert not suits([0.02, 0.1, 0.04])
    assert not suits([0.04, 0.04, 0.2])
