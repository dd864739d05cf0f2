"""Aiming: a nozzle points at another thing for a while; 15 cm beside it, and with its side, it does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from brick_episodes import TABLE
from held_skills import AREA, X_TO_Z, attempt, beside

from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.episodes.skills.registry import SKILLS
from manitwin.episodes.skills.skill import SkillGoal, Surroundings
from manitwin.geometry.frames.label_keywords import grip_rank, is_aiming_label
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose
from manitwin.scenes.layouts.twin_frames import TwinFrame
from rigid_boxes import above, block, box
from twin_folders import twin_id

BODY = replace(
    box([0.05, 0.05, 0.14], 0.3, center_m=(0, 0, 0.07)),
    hulls=(block([-0.025, -0.025, 0], [0.025, 0.025, 0.11]), block([-0.01, -0.015, 0.11], [0.05, 0.015, 0.14])),
)
"""A spray bottle that stands: its nozzle looks along +X."""
NOZZLE = TwinFrame("nozzle", "tip", transform(X_TO_Z, np.array([0.05, 0, 0.125])), 0.01, True)
TRIGGER = TwinFrame("trigger", "button", transform(X_TO_Z, np.array([0.025, 0, 0.09])), 0.005, True)
FROM_BEHIND = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
GRASPS = tuple(Grasp(f"g{i}", above([0, 0, z_m], FROM_BEHIND), 0.05) for i, z_m in enumerate((0.09, 0.08, 0.07)))
CUBE = box([0.05, 0.05, 0.05], 0.1, center_m=(0, 0, 0))


def spot() -> Surroundings:
    twins = [
        PoolTwin(twin_id(i), "0", "thing", (StandingPose(0, np.eye(4), 1.0, 0.1, True),), False, frames)
        for i, frames in enumerate(((NOZZLE, TRIGGER), ()))
    ]
    bodies = dict(zip((each.twin_id for each in twins), (BODY, CUBE), strict=True))
    placed = (
        PlacedObject("object_00", twins[0].twin_id, BODY, transform(None, np.array([0.45, -0.15, 0.0]))),
        PlacedObject("object_01", twins[1].twin_id, CUBE, transform(None, np.array([0.5, 0.15, 0.025]))),
    )
    return Surroundings(placed, Pool(twins, bodies.__getitem__), AREA, (TABLE,))


def goal() -> SkillGoal:
    found = SKILLS["aim"].sample_goal(spot(), 0, 1, np.random.default_rng(1))
    assert found is not None
    return found


def test_the_nozzle_points_and_the_bottle_is_put_back() -> None:
    facts, recording = attempt(spot(), goal(), GRASPS)
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned, facts.plan_failures)
    (event,) = facts.events
    assert event.values["angle_rad"] < 0.03
    assert event.values["held_s"] > 0.5
    assert recording is not None
    assert recording.finger_forces_n[-1].max() == 0


def test_15_cm_beside_it_is_askew() -> None:
    facts, _ = attempt(spot(), goal(), GRASPS, off=beside(0.0, 0.15))
    assert facts.outcome == "goal_missed"
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure in ("askew", "too_far", "too_short")


def test_another_side_does_not_aim() -> None:
    asked = goal()
    make = asked.path
    assert make is not None
    side = replace(
        NOZZLE, frame_to_object=NOZZLE.frame_to_object @ transform(np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]))
    )

    def wrong(scene):
        another = make(replace(scene, frames={"object_00": (side, TRIGGER)}))
        return replace(make(scene), paths=another.paths, otherwise=another.otherwise)

    facts, _ = attempt(spot(), replace(asked, path=wrong), GRASPS)
    assert facts.outcome == "goal_missed"


@pytest.mark.parametrize(("label", "told"), [("nozzle", True), ("lens", True), ("lenses", False), ("handle", False)])
def test_what_points_is_told_by_its_name(label: str, told: bool) -> None:
    assert is_aiming_label(label) == told


def test_a_trigger_is_held_before_a_handle() -> None:
    ranks = [grip_rank(label) for label in ("trigger", "grip", "handle", "nozzle")]
    assert ranks == [0, 1, 2, None]


def test_a_bottle_that_points_stays_as_upright_as_it_can_with_every_grasp_before_it_is_turned_over() -> None:
    found = goal()
    assert found.path is not None
    tasks = []

    def noted(scene: HeldScene) -> HeldTask:
        assert found.path is not None
        tasks.append(found.path(scene))
        return tasks[-1]

    attempt(spot(), replace(found, path=noted), ())
    (task,) = tasks
    assert task.paths and task.otherwise
    tilts = [np.arccos(path.poses[-1][2, 2]) for path in task.paths]
    assert max(tilts) <= np.radians(60) + 1e-6
    assert max(np.arccos(path.poses[-1][2, 2]) for path in task.otherwise) > np.radians(90)
