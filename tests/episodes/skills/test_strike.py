"""Striking: a mallet's face comes down on the block; its other side, or beside the block, is no strike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from held_skills import around, attempt, beside, goal_of, mallet
from scipy.spatial.transform import Rotation

from manitwin.episodes.planning.problem import Grasp, Phase
from manitwin.episodes.skills.registry import SKILLS
from manitwin.geometry.poses import transform

BODY, FRAMES, GRASPS = mallet()
SPOT = around(BODY, FRAMES, 0.5, 0.05)


def test_a_block_is_struck_with_the_face_level_and_fast() -> None:
    facts, recording = attempt(SPOT, goal_of("strike", SPOT), GRASPS)
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned, facts.replans)
    (first, *_) = facts.events
    assert first.values["speed_m_s"] > 0.15
    assert first.values["angle_rad"] < np.radians(5)
    assert recording is not None
    assert {Phase.ACT, Phase.HOLD, Phase.RETURN} <= set(recording.phase)
    assert recording.finger_forces_n[-1].min() > 0  # it is still in the hand


def test_9_cm_beside_the_block_nothing_is_struck() -> None:
    facts, _ = attempt(SPOT, goal_of("strike", SPOT), GRASPS, off=beside(0.0, 0.09))
    assert facts.outcome in ("goal_missed", "no_plan")
    assert facts.outcome == "goal_missed"


def test_the_wrong_face_is_askew() -> None:
    goal = goal_of("strike", SPOT)
    back = transform(np.diag([-1.0, 1, -1]), np.array([0, 0, 0.04])) @ FRAMES[0].frame_to_object  # turned about Y
    other = replace(FRAMES[0], frame_to_object=back)
    make = goal.path
    assert make is not None

    def with_the_other(scene):
        task = make(replace(scene, frames={"object_00": (other,)}))
        return replace(task, watch=make(scene).watch)  # watched is the face that was asked for

    facts, _ = attempt(SPOT, replace(goal, path=with_the_other), GRASPS)
    assert facts.outcome == "goal_missed"
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure in ("wrong_face", "askew")


def test_only_what_has_a_striking_face_strikes() -> None:
    assert SKILLS["strike"].suits(SPOT.pool, SPOT.twin(0), None)
    base = around(BODY, (replace(FRAMES[0], label="base"),), 0.5, 0.05)
    assert not SKILLS["strike"].suits(base.pool, base.twin(0), None)


def test_a_grasp_whose_tilted_fingers_reach_beyond_the_face_is_not_taken() -> None:
    (frame,) = FRAMES
    across = frame.frame_to_object @ transform(
        np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    )  # closes along the face's X, Z of the hand along its Y
    goal = goal_of("strike", SPOT)
    assert goal.path is not None
    asked = {}

    def task(scene):
        asked["task"] = goal.path(scene)
        asked["depth_m"] = scene.tip_depth_m
        return asked["task"]

    attempt(SPOT, replace(goal, path=task), GRASPS[:1])
    rank = asked["task"].rank

    def held(behind_m: float, tilt_rad: float) -> Grasp:
        """A grasp across the head, its pads' middle so far behind the face, its approach tilted towards it."""
        turn = Rotation.from_euler("x", tilt_rad).as_matrix()
        tip = transform(translation=np.array([0.0, 0, -asked["depth_m"]]))
        return Grasp("g", across @ transform(None, np.array([0.0, behind_m, 0])) @ transform(turn) @ tip, 0.04)

    assert rank(held(0.016, 0.0)) is not None
    assert rank(held(0.012, 0.0)) is None  # half a finger's width is 9 mm
    tilted = [rank(held(0.016, sign * np.radians(40))) for sign in (1, -1)]
    assert None in tilted
    assert rank(held(0.04, 0.0)) is not None
