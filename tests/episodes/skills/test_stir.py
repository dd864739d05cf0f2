"""Stirring: a stick goes around in a bowl of granules; beside the bowl, or in an empty one, nothing is stirred."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from granular_things import mixing_bowl, two_things, with_fewer
from held_skills import attempt, beside

from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.held_skill import stick_frame
from manitwin.episodes.skills.registry import SKILLS
from manitwin.episodes.skills.skill import SkillGoal
from manitwin.geometry.cavity_floor import floor_below_rim
from manitwin.geometry.poses import transform
from manitwin.scenes.layouts.twin_frames import TwinFrame
from rigid_boxes import above, block, box

LENGTH_M = 0.2
STICK = replace(
    box([LENGTH_M, 0.012, 0.02], 0.05, center_m=(0, 0, 0.01)),
    hulls=(block([-LENGTH_M / 2, -0.006, 0], [LENGTH_M / 2, 0.006, 0.02]),),
)
HANDLE = TwinFrame("handle", "axis", transform(None, np.array([-0.05, 0, 0.01])), 0.1, True)
ACROSS = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
GRASPS = tuple(Grasp(f"g{i}", above([-0.06 - 0.01 * i, 0, 0.013], ACROSS), 0.012) for i in range(3))
SPOT = two_things((STICK, (HANDLE,)), mixing_bowl(), ((0.45, -0.2), (0.5, 0.12)), vessels=(False, True))


def stirred_goal() -> SkillGoal:
    goal = SKILLS["stir"].set_goal(SPOT, 0, 1, np.random.default_rng(1))
    assert goal is not None
    return with_fewer(goal, 30)


@pytest.mark.slow
def test_a_stick_goes_around_in_a_bowl_and_is_laid_back() -> None:
    facts, recording = attempt(SPOT, stirred_goal(), GRASPS)
    assert facts.evaluation is not None, (facts.plan_failures, facts.replans)
    assert facts.evaluation.literals[0].measured["sectors"] == 1.0
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned)
    assert recording is not None
    assert recording.object_positions_m[-1, 0] == pytest.approx(recording.object_positions_m[0, 0], abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(("off_m", "filled", "failure"), [(0.15, True, "missed"), (0.0, False, "nothing_to_stir")])
def test_beside_the_bowl_or_in_an_empty_one_nothing_is_stirred(off_m: float, filled: bool, failure: str) -> None:
    goal = stirred_goal() if filled else replace(stirred_goal(), granules=None)
    facts, _ = attempt(SPOT, goal, GRASPS, off=beside(-off_m, -off_m) @ transform(None, np.array([0, 0, 0.5 * off_m])))
    assert facts.evaluation is not None, (facts.plan_failures, facts.replans)
    assert facts.evaluation.literals[0].failure == failure
    assert facts.outcome == "goal_missed"


def test_only_slender_things_stir_and_only_where_there_is_room() -> None:
    stir, pool = SKILLS["stir"], SPOT.pool
    stick, bowl = SPOT.twin(0), SPOT.twin(1)
    assert stir.suits(pool, stick, bowl)
    assert not stir.suits(pool, bowl, bowl)
    assert not stir.suits(pool, stick, stick)
    assert not stir.suits(pool, stick, None)


def test_the_end_away_from_the_handle_stirs_and_floors_are_where_they_are() -> None:
    frame = stick_frame(np.concatenate(STICK.hulls), (HANDLE,), np.array([0.0, 0, 1]))
    assert frame[:3, 2] == pytest.approx([1, 0, 0], abs=1e-6)
    assert frame[0, 3] == pytest.approx(LENGTH_M / 2)
    body = SPOT.body(1)
    assert body.opening is not None
    floor_m = floor_below_rim(body.body.hulls, body.opening, 0.05)
    assert body.opening.center_m[2] + floor_m == pytest.approx(0.006, abs=1e-6)
