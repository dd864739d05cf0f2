"""A cut as a motion: a knife's edge goes along the line; 15 cm beside it, and with its flat side down, it does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from held_skills import around, attempt, beside, goal_of
from scipy.spatial.transform import Rotation

from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.registry import SKILLS
from manitwin.geometry.frames.label_keywords import is_cutting_edge
from manitwin.geometry.poses import transform
from manitwin.scenes.layouts.twin_frames import TwinFrame
from rigid_boxes import above, block, box

BODY = replace(
    box([0.03, 0.24, 0.02], 0.1, center_m=(0, 0, 0.01)),
    hulls=(block([-0.015, -0.12, 0], [0.015, 0, 0.02]), block([-0.015, 0, 0.009], [0.02, 0.12, 0.011])),
)
"""A knife that lies: a handle 12 cm long, a blade 12 cm long whose edge is its +X side, 5 mm beyond the handle."""
EDGE = TwinFrame(
    "edge", "edge", transform(np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]), np.array([0.02, 0.06, 0.01])), 0.12, False
)


def _leaning(y_m: float, lean_rad: float) -> np.ndarray:
    """A grasp across the handle whose hand leans to the knife's back."""
    lean = Rotation.from_euler("y", -lean_rad).as_matrix()
    return transform(lean, np.array([0.0, y_m, 0.014])) @ above([0, 0, 0])


GRASPS = tuple(
    Grasp(f"g{i}", _leaning(y_m, lean), 0.03)
    for i, (y_m, lean) in enumerate([(-0.05, 0.0), (-0.05, 0.5), (-0.08, 0.7), (-0.07, 0.0)])
)
SPOT = around(BODY, (EDGE,), 0.5, 0.05)


def test_the_edge_goes_along_the_line_and_the_knife_is_put_back() -> None:
    facts, recording = attempt(SPOT, goal_of("cut_motion", SPOT), GRASPS)
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned, facts.plan_failures)
    (event,) = facts.events
    assert min(event.values["share"], event.values["drawn"]) > 0.9
    assert recording is not None
    assert recording.finger_forces_n[-1].max() == 0


def test_15_cm_beside_the_line_nothing_is_cut() -> None:
    facts, _ = attempt(SPOT, goal_of("cut_motion", SPOT), GRASPS, off=beside(0.0, -0.15))
    assert facts.outcome == "goal_missed"


def test_the_flat_side_does_not_cut() -> None:
    goal = goal_of("cut_motion", SPOT)
    make = goal.path
    assert make is not None
    flat = replace(
        EDGE, frame_to_object=EDGE.frame_to_object @ transform(Rotation.from_euler("x", 90, True).as_matrix())
    )
    wrong = replace(
        goal, path=lambda scene: replace(make(scene), paths=make(replace(scene, frames={"object_00": (flat,)})).paths)
    )
    facts, _ = attempt(SPOT, wrong, GRASPS)
    assert facts.outcome == "goal_missed"
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure == "not_along"


def test_only_edges_that_cut_are_drawn() -> None:
    assert is_cutting_edge("kitchen knife", "edge")
    assert not is_cutting_edge("spatula", "front edge")
    assert not is_cutting_edge("putty knife", "edge")
    assert not is_cutting_edge("ruler", "edge")
    assert not SKILLS["cut_motion"].suits(SPOT.pool, SPOT.twin(0), None)  # a thing
    assert SKILLS["cut_motion"].suits(SPOT.pool, replace(SPOT.twin(0), category="knife"), None)
