"""Spoilt URDFs, each given to all who read one: a robot, a hand and an asset."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from small_arm import TOML

from manitwin.assets.asset import Asset
from manitwin.assets.read import read_asset
from manitwin.errors import AssetError, ConfigError, ManiTwinError
from manitwin.robots.grippers.gripper import Gripper, load_gripper
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.load import load_robot
from manitwin.robots.robot import Robot
from manitwin.robots.urdf import inertial_of, origin_of
from manitwin.robots.urdf_reader import read_urdf

MASS = (
    '<inertial><origin xyz="0 0 0.01"/><mass value="1"/>'
    '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>'
)
BOX = '<origin xyz="0 0 0.15" rpy="0 0 0"/><geometry><box size="0.1 0.1 0.3"/></geometry>'
URDF = f"""<robot name="thing">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base">{MASS}<visual>{BOX}<material name="red"/></visual><collision>{BOX}</collision></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="2" effort="10"/></joint>
  <link name="upper"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
  <joint name="lift" type="revolute"><parent link="upper"/><child link="flange"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="2" effort="10"/></joint>
  <link name="flange"><collision><geometry><cylinder radius="0.01" length="0.1"/></geometry></collision></link>
</robot>"""
HAND = """
kind = "multi_finger"
name = "own"
source = "a test"
tip_depth_m = 0.06
force_n = 5.0
finger_friction = 1.0
palm_front_m = 0.01
clearance_m = 0.01
joints = ["turn", "lift"]
fingers = [["upper"], ["flange"]]
urdf = {file = "thing.urdf"}
root_to_gripper = {position_m = [0.0, 0.0, 0.0], quaternion_wxyz = [1.0, 0.0, 0.0, 0.0]}
[drive]
stiffness_nm_rad = 10.0
damping_nm_s_rad = 0.5
torque_limit_nm = 0.5
press_nm = 0.3
speed_rad_s = 2.0
armature_kg_m2 = 0.0005
[[postures]]
name = "pinch"
grasp_types = ["pinch"]
depth_m = [0.06, 0.06]
openings_m = [0.33, 0.37]
joints_rad = [[0.1, 1.0], [0.1, 0.0]]
"""  # fmt: skip
ARM = TOML.replace("small", "thing").replace('"lift", "roll"', '"lift"').replace("0.5, 0.0]", "0.5]")


def read_as_robot(folder: Path) -> Robot:
    (folder / "thing.toml").write_text(ARM)
    return load_robot(str(folder / "thing.toml"))


def read_as_hand(folder: Path) -> Gripper:
    (folder / "hand.toml").write_text(HAND)
    return load_gripper(str(folder / "hand.toml"))


def read_as_asset(folder: Path) -> Asset:
    return read_asset(folder / "thing.urdf", "urdf")


USERS: dict[str, tuple[Callable[[Path], object], type[ManiTwinError]]] = {
    "robot": (read_as_robot, ConfigError),
    "hand": (read_as_hand, ConfigError),
    "asset": (read_as_asset, AssetError),
}
ALL, SIMULATED, SEEN = ("robot", "hand", "asset"), ("robot", "hand"), ("robot", "asset")
DOCTYPE = '<!DOCTYPE robot [{}]><robot name="thing">'
BASE = '<link name="base">'
ORIGIN = '<origin xyz="0 0 0.15" rpy="0 0 0"/>'
SPHERE = '<sphere radius="0.02"/>'
INERTIA = '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>'
AXIS = '<axis xyz="0 1 0"/>'
LIMIT = '<limit lower="-1" upper="1" velocity="2" effort="10"/>'
LIFT = '<joint name="lift" type="revolute">'

SPOILT = [
    (("<robot ", "<robot <"), "its XML is broken", ALL),
    (("</robot>", ""), "its XML is broken", ALL),
    ((URDF, ""), "its XML is broken", ALL),
    ((URDF, "<mujoco/>"), "<mujoco>, not <robot>; give", ALL),
    (('<robot name="thing">', DOCTYPE.format('<!ENTITY a "b">')), "document type, which is not read; remove", ALL),
    (('<robot name="thing">', DOCTYPE.format('<!ENTITY a SYSTEM "file:///etc/hostname">')), "document type", ALL),
    (('<robot name="thing">', '<!DOCTYPE robot SYSTEM "http://localhost/x.dtd"><robot name="thing">'), "document type", ALL),
    (('<robot name="thing">', DOCTYPE.format('<!ENTITY a "ha"><!ENTITY b "&a;&a;">').replace("thing", "&b;")), "document", ALL),
    ((URDF, '<robot name="thing"/>'), "it has no <link>; give", ALL),
    ((BASE, "<link>"), "a <link> has no name; give it one", ALL),
    ((BASE, '<link name="upper">'), "link 'upper' occurs 2 times; give each its own", ALL),
    ((LIFT, '<joint type="revolute">'), "a <joint> has no name; give it one", ALL),
    ((LIFT, '<joint name="turn" type="revolute">'), "joint 'turn' occurs 2 times; give each its own", SIMULATED),
    ((LIFT, '<joint name="lift">'), "joint 'lift' is of the type None; valid are revolute, ", ALL),
    ((LIFT, '<joint name="lift" type="hinge">'), "joint 'lift' is of the type 'hinge'; valid are revolute, ", ALL),
    (('<parent link="upper"/>', ""), "joint 'lift' has no parent link; name one of base, upper, flange", ALL),
    (('<parent link="upper"/>', "<parent/>"), "joint 'lift' has no parent link; name one of", ALL),
    (('<child link="flange"/>', ""), "joint 'lift' has no child link; name one of", ALL),
    (('<parent link="upper"/>', '<parent link="uper"/>'), "joint 'lift' is an unknown link 'uper'; did you mean", SIMULATED),
    (('<child link="flange"/>', '<child link="upper"/>'), "link 'upper' is the child of two joints, 'turn' and .* remove", ALL),
    (('<parent link="base"/>', '<parent link="flange"/>'), "joints of upper, flange form a loop; .* remove", ALL),
    (('<parent link="upper"/>', '<parent link="flange"/>'), "joints of flange form a loop; .* remove", ALL),
    ((BASE, '<link name="loose"/>' + BASE), "links loose, base all have no parent; .* join them", SIMULATED),
    ((ORIGIN, '<origin xyz="0 0" rpy="0 0 0"/>'), "'base' .* 0 has <origin xyz='0 0'>, which needs 3 usable", ALL),
    ((ORIGIN, '<origin xyz="a b c"/>'), "<origin xyz='a b c'>, which needs 3 usable numbers; mend", ALL),
    ((ORIGIN, '<origin xyz=""/>'), "<origin xyz=''>, which needs 3 usable numbers; mend", ALL),
    ((ORIGIN, '<origin rpy="0 0 nan"/>'), "<origin rpy='0 0 nan'>, which needs 3 usable numbers; mend", ALL),
    (('<origin xyz="0.4 0 0"/>', '<origin xyz="0 0 1e300"/>'), "joint 'lift' has <origin xyz='0 0 1e300'>, which needs", ALL),
    (("<geometry>" + SPHERE + "</geometry>", ""), "link 'upper' collision 0 has nothing as its <geometry>; give it one of", ALL),
    ((SPHERE, ""), "link 'upper' collision 0 has nothing as its <geometry>; give it one of", ALL),
    ((SPHERE, SPHERE * 2), "link 'upper' collision 0 has <sphere>, <sphere> as its <geometry>; give it one of", SIMULATED),
    (("<geometry>" + SPHERE, "<geometry/><geometry>" + SPHERE), "'upper' collision 0 has <sphere> as its <geometry>; give", ALL),
    ((SPHERE, "<cone/>"), "link 'upper' collision 0 has <cone> as its <geometry>; give it one of", ALL),
    ((SPHERE, "<sphere/>"), "<sphere> of link 'upper' collision 0 lacks radius; give it", ALL),
    ((SPHERE, '<sphere radius="round"/>'), "<sphere radius='round'>, which needs 1 usable number; mend", ALL),
    ((SPHERE, '<sphere radius="-1"/>'), "<sphere radius='-1'>, which needs 1 usable number; mend", ALL),
    ((SPHERE, '<box/>'), "<box> of link 'upper' collision 0 lacks size; give it", ALL),
    ((SPHERE, '<cylinder radius="1"/>'), "<cylinder> of link 'upper' collision 0 lacks length; give it", ALL),
    ((SPHERE, "<mesh/>"), "<mesh> of link 'upper' collision 0 lacks filename; give it", ALL),
    ((SPHERE, '<mesh filename=""/>'), "<mesh> of link 'upper' collision 0 lacks filename; give it", ALL),
    ((SPHERE, '<mesh filename="a.stl" scale="1 1 inf"/>'), "<mesh scale='1 1 inf'>, which needs 3 usable numbers; mend", ALL),
    ((SPHERE, '<mesh filename="gone.stl"/>'), "mesh 'gone.stl' is not .*; put it there", SIMULATED),
    (
        (SPHERE, '<mesh filename="broken.stl"/>'),
        r"collision 0, .*broken\.stl, has no convex hull .*; repair or replace",
        SIMULATED,
    ),
    ((SPHERE, '<mesh filename="entity.dae"/>'), r"entity\.dae: its XML declares a document type", SIMULATED),
    ((SPHERE, '<mesh filename="thing.urdf"/>'), "valid are .stl, ", SIMULATED),
    (('<mass value="1"/>', "<mass/>"), "<mass> of the inertial of link 'base' lacks value; give it", ALL),
    (('<mass value="1"/>', '<mass value="nan"/>'), "inertial of link 'base' has <mass value='nan'>, which needs 1", ALL),
    (('<mass value="1"/>', '<mass value="a lot"/>'), "inertial of link 'base' has <mass value='a lot'>, which needs 1", ALL),
    (('<mass value="1"/>', '<mass value="-1"/>'), "mass of link 'base' is negative; mend", SIMULATED),
    (('<mass value="1"/>', ""), "inertial of link 'base' lacks <mass> or <inertia>; give both", SIMULATED),
    ((INERTIA, ""), "inertial of link 'base' lacks <mass> or <inertia>; give both", SIMULATED),
    ((INERTIA, '<inertia iyy="1" izz="1"/>'), "<inertia> of the inertial of link 'base' lacks ixx; give it", ALL),
    ((INERTIA, INERTIA.replace('ixy="0"', 'ixy="none"')), "has <inertia ixy='none'>, which needs 1 usable number", ALL),
    ((AXIS, "<axis/>"), "<axis> of joint 'lift' lacks xyz; give it", SIMULATED),
    ((AXIS, '<axis xyz="0 0 0"/>'), "axis of joint 'lift' has no direction; give", SIMULATED),
    ((AXIS, '<axis xyz="up"/>'), "joint 'lift' has <axis xyz='up'>, which needs 3 usable numbers", SIMULATED),
    ((LIMIT, '<limit lower="-1" upper="?" velocity="2"/>'), "joint 'lift' has <limit upper='\\?'>, which needs 1", SIMULATED),
    ((LIMIT, '<limit upper="1" velocity="2" effort="1"/>'), "joint '?lift'? lacks lower or upper of its <limit>", SIMULATED),
    ((LIMIT, ""), "joint '?lift'? (lacks|has no) .*<?limit.*; give", SIMULATED),
    (('<color rgba="1 0 0 1"/>', '<color rgba="red"/>'), "material 'red' has <color rgba='red'>, which needs 4 usable", ALL),
    (('<color rgba="1 0 0 1"/>', "<color/>"), "<color> of material 'red' lacks rgba; give it", ALL),
    (('<material name="red"/>', '<material><color rgba="1 0 0"/></material>'), "visual 0 has <color rgba='1 0 0'>, which", SEEN),
    (("<visual>" + BOX, "<visual>"), "link 'base' visual 0 has nothing as its <geometry>; give it one of", SEEN),
]  # fmt: skip


@pytest.mark.parametrize("user", ALL)
@pytest.mark.parametrize("spoilt", SPOILT, ids=[f"{number:02d}" for number in range(len(SPOILT))])
def test_spoilt_urdf_is_one_line_that_names_file_element_cause_and_remedy(
    tmp_path: Path, spoilt: tuple[tuple[str, str], str, tuple[str, ...]], user: str
) -> None:
    (what, instead), message, users = spoilt
    read, error = USERS[user]
    assert what in URDF
    (tmp_path / "thing.urdf").write_text(URDF.replace(what, instead))
    (tmp_path / "broken.stl").write_bytes(b"no mesh")
    (tmp_path / "entity.dae").write_text('<!DOCTYPE COLLADA [<!ENTITY a "b">]><COLLADA>&a;</COLLADA>')
    if user not in users:
        read(tmp_path)
        return
    with pytest.raises(error, match=message) as caught:
        read(tmp_path)
    said = str(caught.value)
    assert "thing.urdf" in said or "entity.dae" in said or "broken.stl" in said
    assert "\n" not in said and "; " in said


def test_sound_urdf_is_read_by_all(tmp_path: Path) -> None:
    (tmp_path / "thing.urdf").write_text(URDF)
    arm, hand, asset = read_as_robot(tmp_path), read_as_hand(tmp_path), read_as_asset(tmp_path)
    assert arm.arm_joints == ("turn", "lift")
    assert arm.velocity_limits_rad_s.tolist() == [1.0, 1.0], (
        "half of the two rad/s in the file, as the robot's TOML says"
    )
    assert isinstance(hand, MultiFingerGripper) and hand.joints == ("turn", "lift")
    assert (len(asset.visual), len(asset.collision)) == (1, 1)


@pytest.mark.parametrize("user", ALL)
def test_a_file_that_cannot_be_read_is_named(tmp_path: Path, user: str) -> None:
    with pytest.raises(ManiTwinError, match=r"thing\.urdf"):
        USERS[user][0](tmp_path)


def test_fixed_joint_may_write_an_axis_without_direction(tmp_path: Path) -> None:
    """SolidWorks' exporter writes zeros."""
    path = tmp_path / "thing.urdf"
    path.write_text(URDF.replace(LIFT, LIFT.replace("revolute", "fixed")).replace(AXIS, '<axis xyz="0 0 0"/>'))
    assert read_urdf(path).joints["lift"].get("type") == "fixed"


def test_what_a_link_declares_is_read_with_the_defaults_of_the_specification(tmp_path: Path) -> None:
    path = tmp_path / "thing.urdf"
    path.write_text(URDF)
    tree = read_urdf(path)
    mass_kg, inertial_to_link, tensor = inertial_of(tree.link("base")) or (None, np.eye(4), None)
    assert mass_kg == 1 and np.allclose(inertial_to_link[:3, 3], [0, 0, 0.01])
    assert np.allclose(tensor, 0.01 * np.eye(3))
    assert inertial_of(tree.link("upper")) is None
    assert np.array_equal(origin_of(tree.link("upper").find("collision")), np.eye(4))
