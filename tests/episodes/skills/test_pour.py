"""Pouring: a cup is emptied into a bowl and stands where it was; beside the bowl, or empty, nothing is poured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from granular_things import cup, mixing_bowl, plate, two_things, with_fewer
from held_skills import attempt, beside

from manitwin.episodes.courses.held import HeldCourse
from manitwin.episodes.execution import Execution
from manitwin.episodes.planning.held_path import HeldPathPlanner
from manitwin.episodes.planning.problem import Grasp, Phase
from manitwin.episodes.skills.pour import grasp_rank
from manitwin.episodes.skills.registry import SKILLS
from manitwin.episodes.skills.skill import SkillGoal
from manitwin.geometry.poses import transform
from rigid_boxes import above

BODY, FRAMES, GRASPS = cup()
SPOT = two_things((BODY, FRAMES), mixing_bowl(), ((0.5, -0.2), (0.5, 0.12)))


def poured_goal() -> SkillGoal:
    goal = SKILLS["pour"].sample_goal(SPOT, 0, 1, np.random.default_rng(1))
    assert goal is not None
    return with_fewer(goal)


def test_a_cup_is_emptied_into_a_bowl_and_put_back() -> None:
    facts, recording = attempt(SPOT, poured_goal(), GRASPS)
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned, facts.replans, facts.plan_failures)
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].measured["share"] >= 0.9
    assert recording is not None
    assert recording.granules_in_objects is not None
    assert recording.granules_in_objects[0].tolist() == [20, 0]
    assert recording.granules_in_objects[-1, 1] >= 18
    assert recording.object_positions_m[-1, 0] == pytest.approx(recording.object_positions_m[0, 0], abs=0.02)


def test_where_no_way_back_is_found_the_arm_goes_back_as_it_came(monkeypatch: pytest.MonkeyPatch) -> None:
    go_back = HeldCourse._return_along_path

    def without_a_plan(course: HeldCourse, execution: Execution, been: list[np.ndarray]) -> None:
        with monkeypatch.context() as patch:
            patch.setattr(HeldPathPlanner, "plan_spline", lambda *_, **__: None)
            go_back(course, execution, been)

    monkeypatch.setattr(HeldCourse, "_return_along_path", without_a_plan)
    facts, recording = attempt(SPOT, poured_goal(), GRASPS)
    assert facts.replans["back_as_it_came"] == 1
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned)
    assert recording is not None
    went, came = (recording.joint_positions_rad[1:][recording.phase == phase] for phase in (Phase.ACT, Phase.RETURN))
    between = went[:-1, None] + np.linspace(0, 1, 9)[None, :, None] * np.diff(went, axis=0)[:, None]
    away_rad = np.abs(came[:, None] - between.reshape(1, -1, went.shape[1])).max(2).min(1)
    assert away_rad.max() < 0.03


@pytest.mark.slow
def test_poured_15_cm_beside_the_bowl_it_is_spilt() -> None:
    facts, _ = attempt(SPOT, poured_goal(), GRASPS, off=beside(0.0, 0.15))
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure == "spilt"
    assert facts.outcome == "goal_missed"


@pytest.mark.slow
def test_of_an_empty_cup_nothing_is_poured() -> None:
    facts, _ = attempt(SPOT, replace(poured_goal(), granules=None), GRASPS)
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure == "nothing_to_pour"
    assert facts.outcome == "goal_missed"


def test_only_vessels_with_a_lip_pour_and_only_into_wider_ones_that_hold_it() -> None:
    pour, pool = SKILLS["pour"], SPOT.pool
    small, large = SPOT.twin(0), SPOT.twin(1)
    assert pour.suits(pool, small, large)
    assert not pour.suits(pool, large, small)  # a bowl has no side to pour over
    assert not pour.suits(pool, small, small)
    assert not pour.suits(pool, small, None)
    assert not pour.suits(pool, replace(small, frames=()), large)
    dish = two_things((BODY, FRAMES), plate(), ((0.5, -0.2), (0.5, 0.12)))
    assert dish.body(1).opening is not None
    assert not pour.suits(dish.pool, dish.twin(0), dish.twin(1))  # grains roll off a plate
    turned = replace(FRAMES[0], roll_free=True)
    assert not pour.suits(pool, replace(small, frames=(turned,)), large)


def test_grasps_with_a_finger_in_the_stream_are_not_taken_and_the_handle_comes_first() -> None:
    opening = SPOT.body(0).opening
    assert opening is not None
    lip = transform(None, np.array([0.035, 0, 0.08]))

    def over_the_rim(x_m: float) -> Grasp:
        """One finger inside and one outside the wall, closing across it."""
        return Grasp("rim", above([x_m, 0, 0.07]), 0.004)

    def rank(grasp: Grasp) -> float | None:
        return grasp_rank(grasp, opening, lip, 0.1034)

    ranks = {name: rank(each) for name, each in {"handle": GRASPS[0], "opposite": over_the_rim(-0.033)}.items()}
    assert rank(over_the_rim(0.033)) is None
    assert ranks["handle"] is not None
    assert ranks["opposite"] is not None
    assert ranks["handle"] < 1 < ranks["opposite"]
