"""Inserting: a peg stands in the holder tip down; beside the holder, and with its other end first, it does not count."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from brick_episodes import panda
from held_skills import around, attempt, goal_of
from scipy.spatial.transform import Rotation

from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.held_task import HeldScene
from manitwin.episodes.skills.registry import SKILLS
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.scenes.layouts.twin_frames import TwinFrame
from rigid_boxes import above, block, box

LENGTH_M, HALF_M = 0.16, 0.013


def _leaning(straight: np.ndarray, y_m: float, lean_rad: float) -> np.ndarray:
    """A grasp from above whose hand leans away from the tip."""
    turn = Rotation.from_euler("x", -lean_rad).as_matrix()
    return transform(None, np.array([0.0, y_m, 0.018])) @ transform(turn) @ straight


BODY = replace(
    box([2 * HALF_M, LENGTH_M, 2 * HALF_M], 0.04, center_m=(0, 0, HALF_M)),
    hulls=(block([-HALF_M, -LENGTH_M / 2, 0], [HALF_M, LENGTH_M / 2, 2 * HALF_M]),),
)
GRASPS = tuple(
    Grasp(f"g{i}", _leaning(above([0, 0.0, 0.0]), y_m, lean), 2 * HALF_M)
    for i, (y_m, lean) in enumerate([(0.045, 0.6), (0.055, 0.4), (0.035, 0.8), (0.05, 0.0)])
)


def _tip(y_m: float) -> tuple[TwinFrame, ...]:
    return (TwinFrame("tip", "tip", transform(None, np.array([0, y_m, HALF_M])), 0.008, True),)


SPOT = around(BODY, _tip(-LENGTH_M / 2), 0.45, 0.05)


def test_a_peg_stands_in_the_holder_with_its_tip_down() -> None:
    facts, recording = attempt(SPOT, goal_of("insert", SPOT), GRASPS)
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned, facts.plan_failures)
    assert recording is not None
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].measured["below_rim_m"] > 0.05


def test_15_cm_beside_the_holder_it_is_not_inserted() -> None:
    facts, _ = attempt(SPOT, goal_of("insert", SPOT), GRASPS, off=transform(None, np.array([0.0, 0.15, 0])))
    assert facts.outcome == "goal_missed"
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure == "beside_it"


def test_the_other_end_first_is_not_inserted() -> None:
    goal = goal_of("insert", SPOT)
    turned = replace(goal, frames={name: _tip(LENGTH_M / 2) for name in goal.frames})
    make = goal.path
    assert make is not None
    wrong = replace(turned, path=lambda scene: make(replace(scene, frames=goal.frames)))
    facts, _ = attempt(SPOT, wrong, GRASPS)
    assert facts.outcome == "goal_missed"
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure in ("wrong_end", "beside_it")


def test_things_without_a_tip_and_thick_ones_are_not_inserted() -> None:
    assert SKILLS["insert"].suits(SPOT.pool, SPOT.twin(0), None)
    assert not SKILLS["insert"].suits(SPOT.pool, around(BODY, (), 0.5, 0.05).twin(0), None)
    thick = around(replace(BODY, hulls=(block([-0.04, -0.08, 0], [0.04, 0.08, 0.08]),)), _tip(-LENGTH_M / 2), 0.5, 0.05)
    assert not SKILLS["insert"].suits(thick.pool, thick.twin(0), None)


def test_a_blade_goes_into_a_slot_in_which_it_cannot_fall_over() -> None:
    """In a square bore as wide as the blade it stood on its edge, and fell to 28 degrees in another engine."""
    half_m = np.array([0.02, LENGTH_M / 2, 0.0015])
    blade = replace(box(list(2 * half_m), 0.06, center_m=(0, 0, half_m[2])), hulls=(block(-half_m, half_m),))
    tip = (TwinFrame("tip", "tip", transform(None, np.array([0, -LENGTH_M / 2, 0])), 0.002, True),)
    spot = around(blade, tip, 0.45, 0.05)
    goal = goal_of("insert", spot, seed=4)
    bore = goal.fixtures[0].holder
    assert bore is not None
    assert sorted(bore.half_m) == pytest.approx([0.0045, 0.023], abs=1e-4)
    assert goal.path is not None
    scene = HeldScene(
        target=spot.objects[0],
        objects={"object_00": spot.objects[0]},
        partner=None,
        frames=goal.frames,
        openings={},
        places_m={},
        fixtures=goal.fixtures,
        fingers=frozenset(panda()[0].finger_links),
        fingertips_m=np.zeros((1, 3)),
        tip_depth_m=0.1,
        rng=np.random.default_rng(1),
    )
    paths = goal.path(scene).paths
    assert len(paths) == 2
    for path in paths:
        corners = transform_points(inverse(bore.rim_to_world) @ path.poses[-1], blade.hulls[0])
        assert (np.abs(corners[:, :2]) < bore.half_m - 0.0029).all()
        assert corners[:, 2].min() == pytest.approx(0.008 - bore.depth_m, abs=1e-4)
