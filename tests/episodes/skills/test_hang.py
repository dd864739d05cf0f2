"""Hanging: a tag goes on the peg by its hole and stays; 3 cm beside the peg it falls, and nobody says that it hangs."""

from __future__ import annotations

import numpy as np
from held_skills import around, attempt, goal_of, tag

from manitwin.episodes.planning.problem import Phase
from manitwin.episodes.skills.registry import SKILLS
from manitwin.geometry.poses import transform

BODY, FRAMES, GRASPS = tag()
SPOT = around(BODY, FRAMES, 0.5, 0.05)


def test_a_tag_hangs_on_the_peg_by_its_hole_when_it_is_let_go() -> None:
    facts, recording = attempt(SPOT, goal_of("hang", SPOT), GRASPS)
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned, facts.replans)
    assert recording is not None
    assert {Phase.ACT, Phase.OPEN, Phase.RETREAT} <= set(recording.phase)
    assert recording.object_positions_m[-1, 0, 2] > 0.1
    assert facts.replans["after_lift"] == 1


def test_3_cm_beside_the_peg_it_does_not_hang() -> None:
    goal = goal_of("hang", SPOT)
    across = goal.fixtures[0].frame_to_world[:3, 1]
    facts, _ = attempt(SPOT, goal, GRASPS, off=transform(None, 0.03 * across))
    assert facts.outcome == "goal_missed"
    assert facts.evaluation is not None
    assert not facts.evaluation.reached


def test_only_things_with_a_hole_for_the_peg_are_hung() -> None:
    twin = SPOT.twin(0)
    assert SKILLS["hang"].suits(SPOT.pool, twin, None)
    narrow = around(BODY, tuple(type(f)(f.label, f.kind, f.frame_to_object, 0.005, False) for f in FRAMES), 0.5, 0.05)
    assert not SKILLS["hang"].suits(narrow.pool, narrow.twin(0), None)
    assert not SKILLS["hang"].suits(SPOT.pool, around(BODY, (), 0.5, 0.05).twin(0), None)


def test_grasps_at_the_hole_are_not_taken() -> None:
    at_hole = tuple(
        type(g)(g.grasp_id, g.gripper_to_object @ transform(None, np.array([0, -0.09, 0])), g.width_m) for g in GRASPS
    )
    facts, _ = attempt(SPOT, goal_of("hang", SPOT), at_hole)
    assert facts.outcome == "no_plan"
    assert facts.plan_failures["blocks_function"] == len(GRASPS)
