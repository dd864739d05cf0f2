"""Pressing: the closed fingertips push a button until it pushes back; 3 cm beside it is not pressed."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from brick_episodes import panda
from held_skills import around, attempt, beside, goal_of, remote

from manitwin.episodes.planning.closed_hand import fingertip_corners, first_corner
from manitwin.episodes.planning.problem import Phase
from manitwin.episodes.skills.press import pressed_place
from manitwin.episodes.skills.registry import SKILLS
from manitwin.geometry.poses import transform

BODY, FRAMES = remote()
SPOT = around(BODY, FRAMES, 0.5, 0.1)


def test_a_button_is_pressed_with_the_force_and_nothing_else() -> None:
    facts, recording = attempt(SPOT, goal_of("press", SPOT), ())
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned)
    best = max(facts.events, key=lambda event: event.values["force_n"])
    assert best.values["off_m"] < 0.003
    assert 5 <= best.values["force_n"] < 9.5  # it stops at 8 N; at 4 mm/s up to the touch it reached 10.4
    assert recording is not None
    assert [int(p) for p in dict.fromkeys(recording.phase.tolist())] == [
        Phase.CLOSE, Phase.REACH, Phase.ACT, Phase.HOLD, Phase.RETURN, Phase.REST,
    ]  # fmt: skip


def test_3_cm_beside_the_button_is_off() -> None:
    facts, _ = attempt(SPOT, goal_of("press", SPOT), (), off=beside(0.0, -0.03))
    assert facts.outcome == "goal_missed"
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure == "off"


def test_a_button_on_the_underside_is_not_pressed() -> None:
    under = around(
        BODY, (replace(FRAMES[0], frame_to_object=transform(np.diag([1.0, -1, -1]), np.zeros(3))),), 0.5, 0.1
    )
    assert SKILLS["press"].suits(SPOT.pool, SPOT.twin(0), None)
    assert not SKILLS["press"].suits(under.pool, under.twin(0), None)


def test_the_middle_of_a_top_that_is_a_hole_is_not_pressed() -> None:
    block = replace(FRAMES[0], frame_to_object=transform(translation=np.array([0, 0, 0.06])), kind="face")
    halves = tuple(np.array(list(product((s * 0.015, s * 0.05), (-0.04, 0.04), (0, 0.06)))) for s in (-1, 1))
    holed = around(replace(BODY, hulls=halves), (block,), 0.5, 0.1)
    beside_it = replace(block, frame_to_object=transform(translation=np.array([0.03, 0, 0.06])))
    assert not SKILLS["press"].suits(holed.pool, holed.twin(0), None)
    solid = around(replace(BODY, hulls=halves), (beside_it,), 0.5, 0.1)
    assert SKILLS["press"].suits(solid.pool, solid.twin(0), None)


def test_a_button_that_lies_on_the_table_has_no_way_to_be_pressed() -> None:
    placed = SPOT.objects[0]
    turned = placed.object_to_world @ transform(np.diag([1.0, -1, -1]), np.array([0, 0, 0.03]))
    lying = replace(SPOT, objects=(replace(placed, object_to_world=turned),))
    facts, _ = attempt(lying, goal_of("press", SPOT), ())
    assert facts.outcome == "no_plan"


def test_the_first_corner_of_a_tilted_hand_leads() -> None:
    corners = fingertip_corners(panda()[1].closed_hand)
    assert np.ptp(corners, axis=0)[:2] == pytest.approx(
        [0.0304, 0.0175], abs=2e-4
    )  # of the Panda: measured on its meshes
    down = np.array([0.0, 0, -1])
    level = np.diag([1.0, -1, -1])
    _, lead_m = first_corner(corners, level, down)
    assert lead_m < 1e-6  # level: all of them at once


def test_the_place_is_the_one_that_looks_upward_by_then() -> None:
    """A thing that was laid another way since is pressed at what looks upward now."""
    over = transform(np.diag([1.0, -1, -1]), np.array([0.0, 0, 0.02]))
    frames = (FRAMES[0], replace(FRAMES[0], frame_to_object=over @ FRAMES[0].frame_to_object))
    standing = transform(translation=np.array([0.4, 0.1, 0.0]))
    for pose, expected in ((standing, frames[0]), (standing @ over, frames[1])):
        assert pressed_place(frames, pose) == pytest.approx(pose @ expected.frame_to_object)
        assert pressed_place(frames, pose)[2, 2] > 0.8
    on_edge = standing @ transform(np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]))
    assert pressed_place(frames, on_edge) == pytest.approx(on_edge)
