"""Two arms in one world: each stands where its base is, under names of its own, and touches the other one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sapien
from sapien import physx

from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.errors import UsageError
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.robot import SapienRobot
from manitwin.physics.sapien.world import RobotWorld
from manitwin.robots.load import load_robot
from manitwin.robots.two_arms import base_to_world, place_arm
from rigid_boxes import box

TWO = """
name = "mine"
source = "a test"

[[arms]]
name = "left"
robot = "panda"
base_to_world = { position_m = [0.0, 0.0, 0.0], quaternion_wxyz = [1.0, 0.0, 0.0, 0.0] }

[[arms]]
name = "right"
robot = "panda"
base_to_world = { position_m = [0.1, -0.8, 0.05], quaternion_wxyz = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476] }
"""
BASE = transform(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([0.1, -0.8, 0.05]))


def of_toml(folder: Path, change: tuple[str, str] = ("", "")) -> str:
    assert change[0] in TWO
    path = folder / "mine.toml"
    path.write_text(TWO.replace(*change) if change[0] else TWO)
    return str(path)


def test_each_arm_stands_at_its_base(tmp_path: Path) -> None:
    right = load_robot(of_toml(tmp_path)).arms[1]
    panda, other_rad = load_robot("panda"), np.array([0.4, -0.5, 0.3, -2.0, 0.2, 1.7, 0.1])
    np.testing.assert_allclose(base_to_world(right), BASE, atol=1e-12)
    alone, planned = ArmKinematics(panda), ArmKinematics(right)
    for joints_rad in (panda.home_rad, other_rad):
        np.testing.assert_allclose(planned.gripper_pose(joints_rad), BASE @ alone.gripper_pose(joints_rad), atol=1e-9)
    simulated = SapienRobot(sapien.Scene([physx.PhysxCpuSystem()]), right)
    simulated.put(other_rad, right.open_hand)
    np.testing.assert_allclose(simulated.gripper_pose(), planned.gripper_pose(other_rad), atol=1e-5)


def test_joints_and_links_of_both_have_their_arm_s_name_before_them(tmp_path: Path) -> None:
    robot = load_robot(of_toml(tmp_path))
    left, right = robot.arms
    assert (left.name, right.name) == ("left", "right")
    assert robot.arm_joints == (*left.arm_joints, *right.arm_joints)
    assert right.arm_joints[0] == "right_panda_joint1"
    assert robot.hand_state_names == ("left_gripper_opening_m", "right_gripper_opening_m")
    assert len(robot.home_rad) == len(robot.velocity_limits_rad_s) == 14
    np.testing.assert_array_equal(robot.hand_joints(np.array([0.08, 0.02])), [0.04, 0.04, 0.01, 0.01])


def test_the_same_file_has_the_same_digest_and_another_base_another(tmp_path: Path) -> None:
    first = load_robot(of_toml(tmp_path))
    assert load_robot(of_toml(tmp_path)).sha256 == first.sha256
    assert load_robot(of_toml(tmp_path, ("-0.8", "-0.9"))).sha256 != first.sha256


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('name = "right"', 'name = "left"'), "two arms are named left; give each a name of its own"),
        (('name = "right"', 'name = "Right arm"'), r"arms\.1\.name"),
        (("position_m = [0.0, 0.0, 0.0]", "position_m = [0.2, 0.0, 0.0]"), "arm left is not at the origin"),
        (('name = "right"\nrobot = "panda"', 'name = "right"\nrobot = "two_pandas"'), "two_pandas has two arms itself"),
        (
            ('name = "right"\nrobot = "panda"', 'name = "right"\nrobot = "ur5_robotiq"'),
            "need the same two-jaw gripper",
        ),
        (('name = "right"\nrobot = "panda"', 'name = "right"\nrobot = "pandaa"'), "did you mean 'panda'"),
        (('name = "right"\nrobot = "panda"', 'name = "right"\nrobot = "mine.toml"'), "has two arms itself"),
        (('name = "right"\nrobot = "panda"', 'name = "right"\nrobot = "../a.toml"'), "is not below"),
        (("quaternion_wxyz = [1.0, 0.0, 0.0, 0.0]", "quaternion_wxyz = [2.0, 0.0, 0.0, 0.0]"), "of length 1"),
    ],
)
def test_a_file_of_two_arms_that_cannot_be_used_is_refused_in_one_line(
    tmp_path: Path, change: tuple[str, str], message: str
) -> None:
    with pytest.raises(UsageError, match=message) as caught:
        load_robot(of_toml(tmp_path, change))
    assert "\n" not in str(caught.value)


def test_two_arms_are_put_into_a_scene_one_by_one() -> None:
    scene = sapien.Scene([physx.PhysxCpuSystem()])
    with pytest.raises(ValueError, match="two arms"):
        SapienRobot(scene, load_robot("two_pandas"))


def test_an_arm_without_a_base_of_its_own_is_where_it_was() -> None:
    panda = load_robot("panda")
    there = place_arm(panda, "arm", np.eye(4))
    np.testing.assert_allclose(
        ArmKinematics(there).gripper_pose(panda.home_rad), ArmKinematics(panda).gripper_pose(panda.home_rad), atol=1e-12
    )


def world() -> RobotWorld:
    brick = PlacedObject(
        "object_00", "brick", box([0.04, 0.04, 0.04], 0.1), transform(None, np.array([0.3, 0.5, 0.02]))
    )
    return RobotWorld(
        load_robot("two_pandas"), brick, closing_force_n=50.0, timestep_s=1 / 120, contact_offset_m=0.001,
        solver_iterations=10, solver_iterations_held=24, max_contact_force_n=0.5,
    )  # fmt: skip


def test_arms_that_meet_stop_one_another_and_that_is_told() -> None:
    with world() as made:
        giver, taker = made.robots
        home_rad = np.array(giver.robot.home_rad)
        made.step(2)
        assert not made.contacts.unplanned(made.contacts.read(), in_hand=False)
        forward_rad = home_rad + np.array([0.0, 0.7, 0, 0.9, 0, 0.2, 0])  # into the other hand, 25 cm ahead
        seen = set[tuple[str, str]]()
        for number in range(240):
            giver.set_targets(home_rad + (forward_rad - home_rad) * min(1.0, number / 120), np.zeros(7))
            taker.set_targets(home_rad, np.zeros(7))
            made.step()
            seen |= made.contacts.unplanned(made.contacts.read(), in_hand=False)
        assert any(one.startswith("giver_") and other.startswith("taker_") for one, other in seen)
        free_m = ArmKinematics(giver.robot).gripper_pose(forward_rad)[0, 3]
        assert giver.gripper_pose()[0, 3] < free_m - 0.01, "it was stopped"
        pressing = made.contacts.pressing_pairs(made.contacts.read())
        assert frozenset({"giver", "taker"}) in pressing
        del giver, taker


def test_each_arm_s_fingers_are_those_of_its_own_reader() -> None:
    with world() as made:
        made.select_arm(1)
        assert made.robot.robot.name == "taker"
        assert made.contacts is made.readers[1]
        made.select_arm(0)
        assert made.robot.robot.name == "giver"
