"""Wiping: a sponge's face goes over the patch with 3 N; beside the board, and on its narrow end, it does not count."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from held_skills import around, attempt, beside, goal_of

from manitwin.episodes.courses.force_control import Admittance, with_heights
from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.episodes.planning.path_timing import joint_spline
from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.recording import RATE_HZ, Recording
from manitwin.episodes.skills.registry import SKILLS
from manitwin.geometry.frames.label_keywords import is_wiping_face
from manitwin.geometry.poses import rotation_angle_rad, rotation_from_quaternion_wxyz, transform, transform_points
from manitwin.robots.load import load_robot
from manitwin.scenes.layouts.twin_frames import TwinFrame
from rigid_boxes import above, block, box

SIZE_M = [0.05, 0.10, 0.03]
BODY = box(SIZE_M, 0.03, center_m=(0, 0, 0.015))
BODY = replace(BODY, hulls=(block([-0.025, -0.05, 0], [0.025, 0.05, 0.03]),))
DOWN = np.diag([1.0, -1.0, -1.0])
FACE = TwinFrame("scouring side", "face", transform(DOWN), 0.04, False)
END = TwinFrame(
    "scouring side",
    "face",
    transform(np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.array([0, -0.05, 0.015])),
    0.02,
    False,
)
GRASPS = tuple(Grasp(f"g{i}", above([0, y_m, 0.02]), 0.05) for i, y_m in enumerate((0.0, 0.015, -0.015)))
SPOT = around(BODY, (FACE,), 0.5, 0.05)


def test_the_patch_is_wiped_with_a_force_that_is_kept() -> None:
    facts, recording = attempt(SPOT, goal_of("wipe", SPOT), GRASPS)
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned, facts.plan_failures)
    (event,) = facts.events
    assert event.values["share"] > 0.9
    assert event.values["force_n"] == pytest.approx(3.0, abs=0.3)
    assert event.values["in_band"] > 0.9
    assert recording is not None
    assert_speeds_are_those_of_the_motion(recording)


def assert_speeds_are_those_of_the_motion(recording: Recording) -> None:
    """Compare the recorded speeds with what poses two rows apart say: the engine's were 0.3 m/s and 7 rad/s beside."""
    poses = [
        transform(rotation_from_quaternion_wxyz(turn.astype(float)), at_m.astype(float))
        for at_m, turn in zip(recording.object_positions_m[:, 0], recording.object_quaternions_wxyz[:, 0], strict=True)
    ]
    centers_m = np.array([transform_points(pose, BODY.center_of_mass_m[None])[0] for pose in poses])
    turned_rad = np.array([rotation_angle_rad(b[:3, :3] @ a[:3, :3].T) for a, b in itertools.pairwise(poses)])
    moved_m_s = (centers_m[2:] - centers_m[:-2]) * RATE_HZ / 2
    assert np.linalg.norm(recording.object_linear_velocities_m_s[1:-1, 0] - moved_m_s, axis=1).max() < 0.1
    spins_rad_s = np.linalg.norm(recording.object_angular_velocities_rad_s[1:-1, 0], axis=1)
    still = np.maximum(turned_rad[1:], turned_rad[:-1]) < 1e-3
    assert still.sum() > 50
    assert spins_rad_s[still].max() < 0.3


def test_15_cm_beside_the_board_nothing_is_wiped() -> None:
    facts, _ = attempt(SPOT, goal_of("wipe", SPOT), GRASPS, off=beside(0.0, 0.15))
    assert facts.outcome == "goal_missed"


def test_the_narrow_side_is_the_wrong_face() -> None:
    goal = goal_of("wipe", SPOT)
    make = goal.path
    assert make is not None
    wrong = replace(
        goal, path=lambda scene: replace(make(scene), paths=make(replace(scene, frames={"object_00": (END,)})).paths)
    )
    facts, _ = attempt(SPOT, wrong, GRASPS)
    assert facts.outcome == "goal_missed"
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure == "wrong_face"


def test_only_what_wipes_and_is_thick_enough_for_fingers_is_taken() -> None:
    assert SKILLS["wipe"].suits(SPOT.pool, SPOT.twin(0), None)
    assert not SKILLS["wipe"].suits(SPOT.pool, around(BODY, (replace(FACE, label="base"),), 0.5, 0.05).twin(0), None)
    thin = around(replace(BODY, hulls=tuple(hull * [1, 1, 0.3] for hull in BODY.hulls)), (FACE,), 0.5, 0.05)
    assert not SKILLS["wipe"].suits(thin.pool, thin.twin(0), None)
    assert is_wiping_face("sponge", "back face")
    assert is_wiping_face("cleaning brush", "bristles")
    assert not is_wiping_face("mug", "base")
    assert not is_wiping_face("soap dispenser", "base")


def test_the_height_settles_where_a_spring_presses_as_asked() -> None:
    stiffness_n_m, keeps = 2e4, Admittance(lambda: 0.0, 3.0, 1 / 120)
    keeps.force_n = lambda: max(0.0, -stiffness_n_m * (keeps.height_m - 2e-4))
    changes = [keeps.next_change(np.ones(1))[0] for _ in range(240)]
    assert keeps.force_n() == pytest.approx(3.0, rel=0.01)
    assert changes[-1] == keeps.height_m
    assert abs(changes[-1] - changes[-2]) < 1e-7


def test_the_joints_of_another_height_reach_it() -> None:
    arm = ArmKinematics(load_robot("panda"))
    hands = [transform(DOWN, np.array([0.45 + 0.01 * i, 0.1, 0.2])) for i in range(6)]
    knots = [arm.inverse(hands[0], arm.home)]
    for hand in hands[1:]:
        knots.append(arm.inverse(hand, knots[-1]))
    joints = joint_spline(np.array(knots))
    both = with_heights(joints, arm, np.array([0.0, 0, 1]))
    assert both is not None
    for place in (0.0, 0.37, 1.0):
        row = both(place)
        higher = arm.gripper_pose(row[: arm.joints] + 0.005 * row[arm.joints :])
        assert higher[2, 3] == pytest.approx(arm.gripper_pose(joints(place))[2, 3] + 0.005, abs=1e-4)
