"""A user's own robot: what is read, and what is refused with what would be valid."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import trimesh
from small_arm import box, mesh, small_arm

from manitwin.errors import Unavailable, UsageError
from manitwin.robots.definition import RobotDefinition
from manitwin.robots.links import poses_at, read_urdf_links
from manitwin.robots.load import load_robot


def test_own_urdf_with_generated_hand_has_the_forward_kinematics_of_its_lengths(tmp_path: Path):
    robot = load_robot(small_arm(tmp_path))
    turn, lift = 0.3, 0.5
    poses = poses_at(read_urdf_links(robot.urdf), dict(zip(robot.arm_joints, (turn, lift, 0.0), strict=True)))
    tips = poses[robot.tip_link] @ robot.gripper_to_tip @ np.array([0, 0, robot.gripper.tip_depth_m, 1])
    radius = 0.4 + np.cos(lift) * (0.4 + robot.gripper.tip_depth_m)
    height = 0.3 - np.sin(lift) * (0.4 + robot.gripper.tip_depth_m)  # the stand of 1 m below the base is dropped
    assert np.allclose(tips[:3], [radius * np.cos(turn), radius * np.sin(turn), height], atol=1e-9)
    assert np.allclose(robot.velocity_limits_rad_s, [1.0, 1.0, 1.5])


def test_meshes_are_found_beside_the_urdf_and_below_the_package_folder(tmp_path: Path):
    (tmp_path / "parts").mkdir()
    trimesh.creation.box((0.3, 0.05, 0.05)).export(tmp_path / "parts" / "link.stl")
    robot = load_robot(small_arm(tmp_path, upper=mesh("parts/link.stl"), fore=mesh("package://parts/link.stl")))
    assert robot.urdf.count(str(tmp_path / "parts" / "link.stl")) == 2
    corners = next(link for link in read_urdf_links(robot.urdf) if link.name == "upper").shapes[0].corners_m
    assert np.allclose(np.abs(corners), [0.15, 0.025, 0.025])


def test_digest_follows_a_mesh_and_not_the_folder(tmp_path: Path):
    digests = []
    for number, size in enumerate((0.3, 0.3, 0.2)):
        folder = tmp_path / str(number)
        folder.mkdir()
        trimesh.creation.box((size, 0.05, 0.05)).export(folder / "link.stl")
        digests.append(load_robot(small_arm(folder, upper=mesh("link.stl"))).sha256)
    assert digests[0] == digests[1] != digests[2]


def test_continuous_joint_becomes_revolute_within_the_limits_that_are_given(tmp_path: Path):
    change = ('name="turn" type="revolute"', 'name="turn" type="continuous"')
    with pytest.raises(UsageError, match="turn is continuous; give its range under limits_rad"):
        load_robot(small_arm(tmp_path, urdf=change))
    given = ("[workspace]", "[limits_rad]\nturn = [-1.5, 1.5]\n\n[workspace]")
    robot = load_robot(small_arm(tmp_path, urdf=change, toml=given))
    turn = next(link for link in read_urdf_links(robot.urdf) if link.joint == "turn")
    assert turn.joint_type == "revolute" and turn.limits == (-1.5, 1.5)


def test_a_joint_of_neither_arm_nor_hand_is_fixed_where_the_file_says(tmp_path: Path):
    upper = box("0.3 0.05 0.05", "0.2 0 0")
    door = (
        "</robot>",
        '<joint name="door" type="prismatic"><parent link="upper"/><child link="flap"/><origin xyz="0 0 0.1"/>'
        '<axis xyz="0 0 2"/><limit lower="0" upper="1" velocity="1" effort="1"/></joint><link name="flap"/></robot>',
    )
    with pytest.raises(UsageError, match="fixed_joints must give a position for door"):
        load_robot(small_arm(tmp_path, upper=upper, urdf=door))
    given = ("[urdf]", "[fixed_joints]\ndoor = 0.25\n\n[urdf]")
    poses = poses_at(read_urdf_links(load_robot(small_arm(tmp_path, urdf=door, toml=given)).urdf), {})
    assert np.allclose(poses["flap"][:3, 3] - poses["upper"][:3, 3], [0, 0, 0.35])


@pytest.mark.parametrize(
    "change, message",
    [
        (("<robot ", "<robot <"), "its XML is broken"),
        (('<robot name="small">', '<!DOCTYPE robot [<!ENTITY a "b">]><robot name="small">'), "declares a document type"),
        (('<parent link="fore"/>', '<parent link="four"/>'), "did you mean 'fore'"),
        (('<link name="flange"/>', '<link name="flange"/><link name="loose"/>'), "loose all have no parent"),
        (('<child link="flange"/>', '<child link="fore"/>'), "link 'fore' is the child of two joints"),
        (('name="lift" type="revolute"', 'name="lift" type="prismatic"'), "lift is prismatic; an arm's joints are revolute"),
        (('name="lift" type="revolute"', 'name="lift" type="planar"'), "'planar'; valid are revolute"),
        (('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><mimic joint="turn"/>'), "lift mimics another"),
        (('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>'), "axis of joint 'lift' has no direction"),
        (('<origin xyz="0 0 0.3"/>', '<origin xyz="0 0 nan"/>'), "needs 3 usable"),
        (('<origin xyz="0 0 0.3"/>', '<origin xyz="0 0 1e30"/>'), "needs 3 usable"),
        (('velocity="3"', 'velocity="0"'), "roll has no velocity limit"),
        (('lower="-3" upper="3"', 'lower="3" upper="-3"'), "roll has no range"),
        (('<box size="0.1 0.1 0.3"/>', "<box/>"), "lacks size"),
        (('<box size="0.1 0.1 0.3"/>', '<capsule radius="1"/>'), "one of box, cylinder, sphere, mesh"),
        (('<link name="flange"/>', '<link name="flange"><inertial><mass value="1"/></inertial></link>'), "lacks <mass> or"),
    ],
)  # fmt: skip
def test_spoilt_urdf_is_refused_in_one_line(tmp_path: Path, change: tuple[str, str], message: str):
    with pytest.raises(UsageError, match=message) as caught:
        load_robot(small_arm(tmp_path, urdf=change))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "change, message",
    [
        (('file = "small.urdf"', 'file = "smal.urdf"'), "is not there"),
        (('file = "small.urdf"', 'file = "../small.urdf"'), "put it below that folder"),
        (('file = "small.urdf"', 'file = "small.urdf"\npackage_folder = "/"'), "package_folder lies outside"),
        (('"turn", "lift"', '"turn", "lft"'), "unknown joint 'lft'; did you mean 'lift'. Valid: lift, "),
        (('"turn", "lift"', '"lift", "turn"'), "on the way to panda_palm are turn, lift, roll"),
        (('base_link = "base"', 'base_link = "bas"'), "unknown link 'bas'; did you mean 'base'"),
        (('mount_link = "flange"', 'mount_link = "tool0"'), "unknown link 'tool0'"),
        (('gripper = "panda"', 'gripper = "allegro"'), "not a ParallelGripper"),
        (('gripper = "panda"', 'gripper = "../hand.toml"'), "is not below"),
        (("[0.0, 0.5, 0.0]", "[0.0, 2.5, 0.0]"), "home_rad of lift is 2.5; its limits are -2 to 2"),
        (("[0.0, 0.5, 0.0]", "[0.0, 0.5]"), "home_rad needs 3 values"),
        (("velocity_fraction = 0.5", "velocity_fraction = 0.5\nspeed = 1"), "speed: Extra inputs"),
        (("[1.0, 0.0, 0.0, 0.0]", "[0.0, 0.0, 0.0, 0.0]"), "length 1"),
        (("[workspace]", "[limits_rad]\nturn = [-3.0, 1.0]\n[workspace]"), "limits_rad of turn exceed the URDF's -2 to 2"),
        (("[workspace]", "[limits_rad]\nelbow = [-3.0, 1.0]\n[workspace]"), "limits_rad names elbow"),
        (("[workspace]", "[fixed_joints]\nturn = 0.0\n[workspace]"), "fixed_joints must give a position for no joint"),
    ],
)  # fmt: skip
def test_spoilt_toml_is_refused_in_one_line(tmp_path: Path, change: tuple[str, str], message: str):
    with pytest.raises(UsageError, match=message) as caught:
        load_robot(small_arm(tmp_path, toml=change))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "name", ["../secret.stl", "/etc/hostname", "file:///etc/hostname", "package://../secret.stl", "link.stl"]
)
def test_meshes_outside_the_folder_are_not_read(tmp_path: Path, name: str):
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "secret.stl")
    folder = tmp_path / "robot"
    folder.mkdir()
    (folder / "link.stl").symlink_to(tmp_path / "secret.stl")
    with pytest.raises(UsageError, match="lies outside"):
        load_robot(small_arm(folder, upper=mesh(name)))


def test_a_missing_and_a_broken_mesh_are_named(tmp_path: Path):
    with pytest.raises(UsageError, match=r"mesh 'gone.stl' is not there"):
        load_robot(small_arm(tmp_path, upper=mesh("gone.stl")))
    (tmp_path / "broken.stl").write_bytes(b"no mesh")
    with pytest.raises(UsageError, match=r"broken\.stl"):
        load_robot(small_arm(tmp_path, upper=mesh("broken.stl")))


def test_unknown_robots_are_answered_with_the_known_ones():
    with pytest.raises(
        UsageError,
        match=r"did you mean 'panda'.* Valid: panda, two_pandas, ur5_panda, ur5_robotiq, ur5_suction, xarm7_a",
    ):
        load_robot("pandaa")
    with pytest.raises(UsageError, match=r"mine\.toml does not exist"):
        load_robot("mine.toml")


def test_a_distribution_that_is_not_installed_is_named_with_the_remedy(tmp_path: Path):
    change = ('file = "small.urdf"', 'file = "small.urdf"\ndistribution = "no-such-robot-data"\nextra = "robots"')
    with pytest.raises(Unavailable, match=r"no-such-robot-data: pip install 'manitwin\[robots\]'"):
        load_robot(small_arm(tmp_path, toml=change))


def test_without_the_planning_libraries_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    with pytest.raises(Unavailable, match=r"pip install 'manitwin\[robots\]'"):
        load_robot(small_arm(tmp_path))


def test_example_of_the_docs_is_a_definition():
    page = Path(__file__).resolve().parents[2] / "docs" / "robots.md"
    example = page.read_text().split("```toml")[1].split("```")[0]
    assert RobotDefinition.model_validate(tomllib.loads(example)).hand.kind == "generated"


OWN_HAND = """[hand]
kind = "own"
gripper = "panda"
tip_link = "flange"
finger_joints = ["left", "right"]

[hand.gripper_to_tip]
position_m = [0.0, 0.0, 0.0]
quaternion_wxyz = [1.0, 0.0, 0.0, 0.0]
"""


def _with_own_hand(folder: Path, replaced: tuple[str, str] = ("", ""), hand: tuple[str, str] = ("", "")) -> str:
    path = Path(small_arm(folder))
    toml = path.read_text()
    start, end = toml.index("[hand]"), toml.index("[workspace]")
    path.write_text(toml[:start] + OWN_HAND.replace(*hand) + toml[end:])
    fingers = "".join(
        f'<joint name="{name}" type="prismatic"><parent link="flange"/><child link="{name}_finger"/>'
        f'<axis xyz="{sign} 0 0"/><limit lower="0" upper="0.05" velocity="1" effort="1"/>{mimic}</joint>'
        f'<link name="{name}_finger">{box("0.01 0.02 0.05", f"{sign * 0.005} 0 0.0875")}</link>'
        for name, sign, mimic in (("left", 1, ""), ("right", -1, '<mimic joint="left"/>'))
    )
    urdf = (folder / "small.urdf").read_text().replace("</robot>", fingers + "</robot>")
    assert replaced[0] in urdf
    (folder / "small.urdf").write_text(urdf.replace(*replaced) if replaced[0] else urdf)
    return str(path)


def test_own_hand_loses_its_mimicry_and_gets_the_grippers_range(tmp_path: Path):
    robot = load_robot(_with_own_hand(tmp_path))
    assert "mimic" not in robot.urdf
    limits = {link.joint: link.limits for link in read_urdf_links(robot.urdf)}
    assert limits["left"] == limits["right"] == (0.0, 0.04)
    assert robot.hand_links == ("flange", "left_finger", "right_finger")


@pytest.mark.parametrize(
    "replaced, hand, message",
    [
        (("", ""), ('"left", "right"', '"right", "left"'), "not along \\+X; correct gripper_to_tip or the order"),
        (("", ""), ("[0.0, 0.0, 0.0]", "[0.0, 0.0, -0.03]"), "its fingers end 0.1425 m along"),
        (('<mimic joint="left"/>', '<mimic joint="left" multiplier="2"/>'), ("", ""), "must follow left one to one"),
        (('<mimic joint="left"/>', '<mimic joint="lift"/>'), ("", ""), "must follow left one to one"),
        (('upper="0.05"', 'upper="0.03"'), ("", ""), "runs from 0 to 0.03 m; the gripper needs 0 \\(closed\\) to 0.04 m"),
        (('name="left" type="prismatic"', 'name="left" type="revolute"'), ("", ""), "a parallel hand's are prismatic"),
        (("", ""), ('"left", "right"', '"left", "rihgt"'), "did you mean 'right'"),
    ],
)  # fmt: skip
def test_hands_that_close_otherwise_are_refused(
    tmp_path: Path, replaced: tuple[str, str], hand: tuple[str, str], message: str
):
    with pytest.raises(UsageError, match=message):
        load_robot(_with_own_hand(tmp_path, replaced, hand))
