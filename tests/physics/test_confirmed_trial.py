"""A grasp in which the object moved is held only where a second engine holds it too."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.confirmed_trial import MOVED_M, MOVED_RAD, ConfirmedTrial
from manitwin.physics.mujoco.trial import MujocoTrial
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.physics.trial import TrialResult, TrialSettings
from manitwin.robots.grippers.gripper import Gripper
from manitwin.twin.grasp_summary import Outcome
from rigid_boxes import PANDA, SETTINGS, above, box

BRICK = box([0.04, 0.1, 0.04], 0.5)


@dataclass
class Answers:
    """An engine with the results that it is given, by the height of the grasp, and the heights that it was asked for."""

    name: str
    results: dict[float, TrialResult]
    asked_m: list[float] = field(default_factory=list)

    def run(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> list[TrialResult]:
        heights_m = [round(float(pose[2, 3]) - PANDA.tip_depth_m, 3) for pose in gripper_to_object]
        self.asked_m += heights_m
        return [self.results[height_m] for height_m in heights_m]


def result(outcome: Outcome, displacement_m: float = 0.0, rotation_rad: float = 0.0) -> TrialResult:
    return TrialResult(outcome, displacement_m, rotation_rad, 0.0, (50.0, 50.0), 1)


def test_second_engine_is_asked_about_what_moved_and_can_overturn_it() -> None:
    slid, turned = result("held", 1.1 * MOVED_M), result("held", rotation_rad=1.1 * MOVED_RAD)
    still, failed = result("held", 0.9 * MOVED_M, 0.9 * MOVED_RAD), result("slips", 0.02)
    first = Answers("first", {0.0: still, 0.001: slid, 0.002: turned, 0.003: failed})
    refused, agreed = result("drops", 0.03), result("held")
    second = Answers("second", {0.001: agreed, 0.002: refused})
    trial = ConfirmedTrial(first, second)
    poses = np.array([above([0, 0, height_m]) for height_m in first.results])
    confirmed, overturned = replace(slid, second_outcome="held"), replace(refused, second_outcome="drops")
    assert trial.run(BRICK, PANDA, poses, SETTINGS) == [still, confirmed, overturned, failed]
    assert second.asked_m == [0.001, 0.002]
    assert (trial.name, trial.confirmed_by) == ("first", "second")


def test_second_engine_is_not_asked_where_nothing_moved() -> None:
    trial = ConfirmedTrial(SapienTrial(), Answers("second", {}))
    poses = np.array([above([0, 0, 0])])
    assert [each.outcome for each in trial.run(BRICK, PANDA, poses, SETTINGS)] == ["held"]


def test_what_is_held_far_from_its_middle_turns_and_has_to_hold_in_both() -> None:
    ends_m = np.linspace(0.0, 0.045, 10)
    poses = np.array([above([0, y_m, 0]) for y_m in ends_m])
    heavy = box([0.04, 0.1, 0.04], 3.0)
    alone, other = (engine.run(heavy, PANDA, poses, SETTINGS) for engine in (SapienTrial(), MujocoTrial()))
    both = ConfirmedTrial(SapienTrial(), MujocoTrial()).run(heavy, PANDA, poses, SETTINGS)
    held = [each.outcome == "held" for each in both]
    assert any(held) and not all(held)
    assert held == [one.outcome == two.outcome == "held" for one, two in zip(alone, other, strict=True)]
