"""Lifting: a thing is held up in the hand; carried along beside the table's top it is too low."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from held_skills import around, attempt, goal_of, mallet

from manitwin.episodes.planning.problem import Phase
from manitwin.episodes.skills.registry import SKILLS
from manitwin.geometry.poses import transform

BODY, FRAMES, GRASPS = mallet()
SPOT = around(BODY, FRAMES, 0.5, 0.05)


def test_a_thing_is_held_up_and_stays_in_the_hand() -> None:
    facts, recording = attempt(SPOT, goal_of("lift", SPOT), GRASPS)
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned, facts.replans)
    assert facts.evaluation is not None
    assert str(facts.evaluation.goal) == "lifted(object_00, 0.1)"
    assert 0.1 < facts.evaluation.literals[0].measured["rise_m"] < 0.2
    assert recording is not None
    assert {Phase.LIFT, Phase.ACT, Phase.HOLD, Phase.REST} <= set(recording.phase)
    assert Phase.OPEN not in set(recording.phase)
    assert recording.finger_forces_n[-1].min() > 0


def test_a_way_that_ends_7_cm_lower_is_too_low() -> None:
    facts, _ = attempt(SPOT, goal_of("lift", SPOT), GRASPS, off=transform(translation=np.array([0.0, 0, -0.07])))
    assert facts.outcome == "goal_missed"
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure == "too_low"


def test_what_is_let_go_again_is_not_held() -> None:
    goal = goal_of("lift", SPOT)
    make = goal.path
    assert make is not None
    dropped = replace(goal, path=lambda scene: replace(make(scene), ending="let_go"))
    facts, _ = attempt(SPOT, dropped, GRASPS)
    assert facts.outcome == "goal_missed"
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure == "not_held"


def test_anything_can_be_lifted() -> None:
    assert SKILLS["lift"].suits(SPOT.pool, SPOT.twin(0), None)
