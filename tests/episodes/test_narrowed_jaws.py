"""Jaws between things that stand near: opened no wider than the grasp needs, on the way there and as they let go."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from brick_episodes import GRASPS, START, panda, problem, run, standing

from manitwin.episodes.planning.narrowed_jaws import SPARE_M, STEP_M, group_by_opening
from manitwin.episodes.planning.problem import Phase, PickPlaceProblem
from manitwin.robots.grippers.gripper import load_gripper

AWAY_M = 0.04  # of the walls from the brick's sides
PANDA = load_gripper("panda")


def between_walls() -> PickPlaceProblem:
    """The brick between two boxes on the sides of the jaws, which have no room there when they are open."""
    across_m = 0.02 + AWAY_M + 0.01
    walls = [
        standing(name, [0.02, 0.12, 0.1], START[0, 3] + side * across_m, START[1, 3], mass_kg=0.3)
        for name, side in (("object_02", -1), ("object_03", 1))
    ]
    return problem(obstacles=tuple(walls))


def test_each_grasp_has_the_least_step_that_leaves_its_pads_room() -> None:
    widths_m = (0.002, 0.03, 0.02, 0.065)
    grasps = [replace(GRASPS[0], grasp_id=str(place), width_m=width) for place, width in enumerate(widths_m)]
    found = group_by_opening(grasps, PANDA)
    assert [[grasp.grasp_id for grasp in group] for group in found] == [["0"], ["2"], ["1"]]  # not as wide as it goes
    for grasp in (grasp for group in found for grasp in group):
        assert grasp.opening_m is not None
        assert SPARE_M <= grasp.opening_m - grasp.width_m < SPARE_M + STEP_M
    assert group_by_opening(grasps, load_gripper("suction")) == group_by_opening(grasps, load_gripper("allegro")) == []


def test_open_jaws_are_taken_where_they_have_room() -> None:
    report = panda()[1].plan(problem())
    assert report.plan is not None
    assert report.plan.grasp.opening_m is None


def test_narrowed_jaws_take_a_brick_from_between_walls_and_touch_neither() -> None:
    facts, recording = run(between_walls())
    assert (facts.outcome, facts.unplanned) == ("kept", ())
    assert facts.grasp is not None
    opening_m = facts.grasp.opening_m
    assert opening_m == pytest.approx(0.06)
    assert facts.plan_failures["approach_blocked"] == len(GRASPS), "of open jaws"
    assert recording is not None
    told_m, phases = recording.action_hand[:, 0], recording.phase
    assert told_m[0] < PANDA.opening_m, "they go there before the arm leaves"
    for phase in (Phase.APPROACH, Phase.RETREAT):
        assert told_m[phases == phase] == pytest.approx(opening_m)
    assert told_m.max() < PANDA.opening_m
    walls = recording.object_positions_m[:, 1:]
    assert np.linalg.norm(walls[-1] - walls[0], axis=1).max() < 1e-3


def test_the_next_thing_that_has_room_is_taken_with_open_jaws_again() -> None:
    planner = panda()[1]
    narrow = planner.plan(between_walls()).plan
    assert narrow is not None
    assert planner.with_opening_of(narrow.grasp) is planner.with_opening_of(narrow.grasp) is not planner
    assert planner.with_opening_of(GRASPS[0]) is planner.with_opening_of(None) is planner
