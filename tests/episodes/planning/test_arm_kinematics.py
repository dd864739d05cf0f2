"""Kinematics against a planar arm's closed form, and against MuJoCo."""

import mujoco
import numpy as np
import pytest
from mujoco_witness import simulated_urdf
from planar_arm import LENGTHS_M, planar_arm

from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.episodes.planning.arm_solutions import SampledPoses
from manitwin.geometry.poses import rotation_angle_rad, transform
from manitwin.robots.load import load_robot


def closed_form(angles: np.ndarray) -> tuple[np.ndarray, float]:
    turned = np.cumsum(angles)
    return np.array([np.dot(LENGTHS_M, np.cos(turned)), np.dot(LENGTHS_M, np.sin(turned)), 0.5]), float(turned[-1])


@pytest.mark.parametrize("kind", ["revolute", "continuous"])
def test_planar_arm_is_where_its_closed_form_puts_it(kind):
    arm = ArmKinematics(planar_arm(kind))
    for angles in np.random.default_rng(0).uniform(-2, 2, (20, 3)):
        position, heading = closed_form(angles)
        pose = arm.gripper_pose(angles)
        assert pose[:3, 3] == pytest.approx(position, abs=1e-12)
        assert pose[:3, 2] == pytest.approx([np.cos(heading), np.sin(heading), 0], abs=1e-12)  # approach
        assert pose[:3, 0] == pytest.approx([-np.sin(heading), np.cos(heading), 0], abs=1e-12)  # closing


@pytest.mark.parametrize("name", ["panda", "ur5_panda"])
def test_gripper_is_where_mujoco_has_it(name):
    robot = load_robot(name)
    arm = ArmKinematics(robot)
    model = mujoco.MjModel.from_xml_string(simulated_urdf(robot))
    data = mujoco.MjData(model)
    tip = model.body(robot.tip_link).id
    joints = [model.joint(joint).qposadr[0] for joint in robot.arm_joints]
    for angles in np.random.default_rng(1).uniform(arm.lower, arm.upper, (20, arm.joints)):
        data.qpos[joints] = angles
        mujoco.mj_kinematics(model, data)
        expected = transform(data.xmat[tip].reshape(3, 3), data.xpos[tip]) @ robot.gripper_to_tip
        assert arm.gripper_pose(angles) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("name", ["panda", "ur5_panda"])
def test_inverse_kinematics_returns_to_the_pose_within_the_limits(name):
    arm = ArmKinematics(load_robot(name))
    known, rng = SampledPoses(arm), np.random.default_rng(2)
    found = 0
    for angles in arm.home + rng.normal(0, 0.4, (60, arm.joints)):
        pose = arm.gripper_pose(np.clip(angles, arm.lower, arm.upper))
        for start in known.nearest(pose, 6):
            solution = arm.inverse(pose, start)
            if solution is not None:
                reached = arm.gripper_pose(solution)
                assert np.linalg.norm(reached[:3, 3] - pose[:3, 3]) < 1e-4
                assert rotation_angle_rad(reached[:3, :3].T @ pose[:3, :3]) < 1e-4
                assert arm.within_limits(solution)
                found += 1
                break
    assert found >= 57  # 95 per cent


def test_pose_beyond_the_arm_has_no_solution_and_is_known_to_be_out_of_reach():
    arm = ArmKinematics(load_robot("panda"))
    far = transform(np.diag([1.0, -1, -1]), np.array([1.2, 0, 0.2]))
    assert arm.inverse(far, arm.home) is None
    assert SampledPoses(arm).is_out_of_reach(far)
    assert not SampledPoses(arm).is_out_of_reach(arm.gripper_pose(arm.home))


def test_joint_that_turns_twice_is_kept_to_one_turn_about_home():
    arm = ArmKinematics(planar_arm(limit_rad=2 * np.pi))
    assert arm.upper - arm.lower == pytest.approx(2 * np.pi, abs=0.01)
    assert (arm.upper + arm.lower) / 2 == pytest.approx(arm.home, abs=0.01)
