"""A recorded trial: the same verdict as when it is not recorded, and states that follow from the protocol."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.geometry.poses import transform
from manitwin.physics.mujoco.trial import MujocoTrial
from manitwin.physics.sapien.fingers import ArticulatedTrial
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.physics.suction_trial import SuctionTrial
from manitwin.physics.trial import TrialSettings
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from rigid_boxes import FROM_ABOVE, PANDA, SETTINGS, SLIDE_PEAK_M_S2, above, as_a_whole, box

LIMIT_KG = 2 * 0.75 * 50 / (9.81 + SLIDE_PEAK_M_S2)
CUBE_M = [0.04, 0.04, 0.04]


@pytest.mark.parametrize("engine", [SapienTrial(), MujocoTrial()], ids=lambda engine: engine.name)
@pytest.mark.parametrize(("share", "outcome"), [(0.8, "held"), (1.15, "slips"), (2.0, "drops")])
def test_a_recorded_trial_is_that_of_run(engine: SapienTrial | MujocoTrial, share: float, outcome: str) -> None:
    body, pose = box(CUBE_M, share * LIMIT_KG), above([0, 0, 0])
    recording = engine.record(body, PANDA, pose, SETTINGS)
    assert recording.result == engine.run(body, PANDA, pose[None], SETTINGS)[0]
    assert recording.result.outcome == outcome
    count = len(recording.time_s)
    assert count == len(recording.phases) == len(recording.joints) and (np.diff(recording.time_s) > 0).all()
    assert recording.object_to_hand.shape == (count, 4, 4) and recording.hand_m.shape == (count, 3)


def test_hand_goes_up_by_the_lift_and_out_along_each_axis(monkeypatch: pytest.MonkeyPatch) -> None:
    as_a_whole(monkeypatch)  # else the hand does not stop at the end of the lift
    recording = SapienTrial().record(box(CUBE_M, 0.5), PANDA, above([0, 0, 0]), SETTINGS)
    phases = np.array(recording.phases)
    assert list(dict.fromkeys(recording.phases)) == ["open", "close", "lift", "hold", "slide"]
    assert (recording.hand_m[phases == "close"] == 0).all()
    assert recording.hand_m[phases == "lift"][-1] == pytest.approx([0, 0, SETTINGS.lift_m], abs=1e-9)
    out = np.array([0, 0, SETTINGS.lift_m]) + SETTINGS.slide_m
    assert recording.hand_m[-1] == pytest.approx(out, abs=1e-9)


def test_hand_comes_back_from_each_slide_of_a_grasp_at_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    as_a_whole(monkeypatch)  # brief strokes before go out only
    recording = SapienTrial().record(box(CUBE_M, 0.98 * LIMIT_KG), PANDA, above([0, 0, 0]), SETTINGS)
    assert recording.result.outcome == "held"
    slides = recording.hand_m[np.array(recording.phases) == "slide"] - [0, 0, SETTINGS.lift_m]
    assert slides[-1] == pytest.approx([0, 0, 0], abs=1e-9)
    assert (np.abs(slides).max(0) > 0.9 * SETTINGS.slide_m).all(), "the last look of a slide is at its end"


def test_pads_close_onto_the_box_and_it_stays_in_the_hand() -> None:
    recording = SapienTrial().record(box(CUBE_M, 0.5), PANDA, above([0, 0, 0]), SETTINGS)
    assert recording.joints[0] == pytest.approx([PANDA.opening_m / 2] * 2, abs=1e-3)
    assert recording.joints[-1].sum() == pytest.approx(CUBE_M[0], abs=1e-3)
    moved = np.linalg.norm(recording.object_to_hand[-1, :3, 3] - recording.object_to_hand[0, :3, 3])
    assert moved < 0.005
    slipping = SapienTrial().record(box(CUBE_M, 2 * LIMIT_KG), PANDA, above([0, 0, 0]), SETTINGS)
    down = slipping.object_to_hand[-1, :3, 3] - slipping.object_to_hand[0, :3, 3]
    assert (FROM_ABOVE @ down)[2] < -0.01, "it falls along -Z of the object's axes"


def test_grasp_that_reaches_nothing_has_the_one_state_it_would_have_begun_with() -> None:
    recording = SapienTrial().record(box(CUBE_M, 0.5), PANDA, above([0, 0, 1.0]), SETTINGS)
    assert (recording.result.outcome, recording.result.steps) == ("misses", 0)
    assert recording.time_s.tolist() == [0.0] and recording.phases == ("open",)
    assert recording.joints.tolist() == [[PANDA.opening_m / 2] * 2]


@pytest.mark.parametrize(("share", "outcome", "vacuum"), [(0.5, "held", 1.0), (1.5, "drops", 0.0)])
def test_vacuum_is_on_while_it_holds_and_the_object_falls_where_it_lets_go(
    share: float, outcome: str, vacuum: float
) -> None:
    cup = load_gripper("suction")
    settings = TrialSettings(force_n=cup.force_n, finger_friction=cup.finger_friction, slide_m=0.01)
    side_m = 0.06
    pose = transform(FROM_ABOVE, np.array([0, 0, side_m / 2]) - FROM_ABOVE[:, 2] * cup.tip_depth_m)
    body = box([side_m] * 3, share * cup.force_n / 9.81, 0.5)
    recording = SuctionTrial().record(body, cup, pose, settings)
    assert recording.result == SuctionTrial().run(body, cup, pose[None], settings)[0]
    assert recording.result.outcome == outcome and recording.joints[-1] == [vacuum]
    fallen = (recording.object_to_hand[-1] - recording.object_to_hand[0])[:3, 3]
    assert ((FROM_ABOVE @ fallen)[2] < -0.01) == (outcome == "drops")


def test_joints_of_a_hand_are_in_the_order_of_its_file() -> None:
    hand = load_gripper("allegro")
    assert isinstance(hand, MultiFingerGripper)
    posture = hand.postures[0]
    joints = np.stack([posture.joints_at(np.array(width)) for width in (0.07, 0.03)])
    pose = transform(FROM_ABOVE, np.array([0, 0, np.mean(posture.depth_m)]))
    body = box([0.05, 0.2, 0.05], 0.2)
    settings = TrialSettings(force_n=hand.force_n, finger_friction=hand.finger_friction)
    recording = ArticulatedTrial().record(body, hand, pose, settings, joints)
    assert recording.result == ArticulatedTrial().run(body, hand, pose[None], settings, joints[None])[0]
    assert recording.joints[0] == pytest.approx(joints[0], abs=0.02), "the open posture"
    low, high = np.sort(joints, axis=0)
    assert (recording.joints > low - 0.1).all() and (recording.joints < high + 0.1).all()
