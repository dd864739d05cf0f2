"""The many-jointed hand: its URDF against SAPIEN's own reading of it, and grasps whose verdict is plain."""

from __future__ import annotations

from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import sapien
import trimesh
from lxml import etree
from sapien import physx

from manitwin.errors import UsageError
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.sapien.fingers import ArticulatedTrial
from manitwin.physics.trial import TrialResult, TrialSettings
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from rigid_boxes import FROM_ABOVE, box

HAND = load_gripper("allegro")
assert isinstance(HAND, MultiFingerGripper)
POSTURES = {posture.name: posture for posture in HAND.postures}
SETTINGS = TrialSettings(force_n=HAND.force_n, finger_friction=HAND.finger_friction)
SHIPPED = Path(str(resources.files("manitwin.robots.grippers") / "definitions" / "allegro.toml"))


def try_one(
    body: RigidBody,
    width_m: float,
    posture: str = "pinch",
    depth_m: float = 0.09,
    settings: TrialSettings = SETTINGS,
    turn: np.ndarray = FROM_ABOVE,
) -> TrialResult:
    """Close around the origin from above, opened 1 cm wider than the object on each side."""
    some = POSTURES[posture]
    joints = some.joints_at(np.array([width_m + 0.02, width_m - 0.06]))
    pose = transform(turn, -turn[:, 2] * depth_m)
    return ArticulatedTrial().run(body, HAND, pose[None], settings, joints[None])[0]


def sphere(radius_m: float, mass_kg: float) -> RigidBody:
    corners = np.array(trimesh.creation.icosphere(3, radius_m).vertices)
    return RigidBody((corners,), mass_kg, np.zeros(3), 0.4 * mass_kg * radius_m**2 * np.eye(3), 0.5, 0.5)


def test_links_are_where_sapien_s_own_loader_puts_them(tmp_path: Path) -> None:
    from importlib.metadata import distribution

    name = "cmeel.prefix/share/example-robot-data/robots/allegro_hand_description/urdf/allegro_right_hand.urdf"
    robot = etree.parse(str(distribution("example-robot-data").locate_file(name)))
    for element in [e for tag in ("visual", "gazebo", "transmission") for e in robot.getroot().iter(tag)]:
        element.getparent().remove(element)
    stripped = tmp_path / "hand.urdf"
    robot.write(str(stripped))
    scene = sapien.Scene([physx.PhysxCpuSystem()])
    loader = scene.create_urdf_loader()
    loader.fix_root_link = True
    theirs = loader.load(str(stripped))
    low, high = np.array(theirs.get_qlimits()).T
    rng = np.random.default_rng(2)
    for _ in range(5):
        joints = rng.uniform(low, high)
        theirs.set_qpos(joints.astype(np.float32))
        named = {joint.name: value for joint, value in zip(theirs.active_joints, joints, strict=True)}
        ours = HAND.link_poses(np.array([named[joint] for joint in HAND.joints]))
        for link, pose in zip(HAND.links, ours, strict=True):
            expected = HAND.root_to_gripper @ theirs.find_link_by_name(link.name).entity_pose.to_transformation_matrix()
            assert pose == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("name", ["pinch", "envelope"])
@pytest.mark.parametrize("opening_m", [0.01, 0.05, 0.09])
def test_fingertips_of_a_posture_are_as_far_apart_as_it_says(name: str, opening_m: float) -> None:
    links = [link.name for link in HAND.links]
    poses = HAND.link_poses(POSTURES[name].joints_at(np.array(opening_m)))
    thumb, index, middle = (poses[links.index(f"link_{n}.0_tip")][:3, 3] for n in (15, 3, 7))
    assert index[0] - thumb[0] - 0.024 == pytest.approx(opening_m, abs=0.003)
    assert middle[0] - thumb[0] - 0.024 == pytest.approx(opening_m, abs=0.003)
    assert thumb[0] + index[0] == pytest.approx(0, abs=0.003)
    assert thumb[2] == pytest.approx(index[2], abs=0.003)


@pytest.mark.parametrize("width_m", [0.03, 0.06])
def test_box_between_the_fingertips_holds(width_m: float) -> None:
    result = try_one(box([width_m, 0.06, 0.06], 0.1), width_m)
    assert result.outcome == "held"
    assert result.displacement_m < 0.003
    assert len(result.finger_forces_n) == 2
    assert min(result.finger_forces_n) > 5


def test_sphere_in_the_hand_holds() -> None:
    assert try_one(sphere(0.03, 0.1), 0.06, "envelope", 0.085).outcome == "held"


def test_hand_in_the_air_misses_and_hand_in_the_object_collides() -> None:
    aside = box([0.04, 0.04, 0.04], 0.1)
    far = replace(aside, hulls=(aside.hulls[0] + [0, 0, -0.3],), center_of_mass_m=np.array([0, 0, -0.3]))
    assert try_one(far, 0.04).outcome == "misses"
    assert try_one(box([0.04, 0.2, 0.3], 0.1), 0.04, depth_m=0.03).outcome == "collides"


def test_weight_beyond_the_friction_of_the_fingers_falls() -> None:
    # both sides press with about 14 N: 2 mu F = 21 N, of which 3 kg have 29 N
    assert try_one(box([0.04, 0.06, 0.06], 3.0), 0.04).outcome in {"drops", "slips"}


def test_weaker_joints_hold_less() -> None:
    body = box([0.04, 0.06, 0.06], 0.35)
    assert try_one(body, 0.04).outcome == "held"
    weak = replace(SETTINGS, force_n=HAND.force_n / 5)
    assert try_one(body, 0.04, settings=weak).outcome in {"drops", "slips"}


def test_same_grasp_gives_the_same_result_again() -> None:
    body = box([0.04, 0.06, 0.06], 0.1)
    assert try_one(body, 0.04) == try_one(body, 0.04)


def write(folder: Path, old: str, new: str) -> str:
    text = SHIPPED.read_text()
    assert old in text
    (folder / "hand.toml").write_text(text.replace(old, new))
    return str(folder / "hand.toml")


def test_missing_distribution_names_the_extra(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"pip install 'manitwin\[robots\]'"):
        load_gripper(write(tmp_path, '"example-robot-data"', '"example-robot-data-that-is-not-there"'))


def test_urdf_beside_the_file_may_not_leave_its_folder(tmp_path: Path) -> None:
    beside = write(tmp_path, 'distribution = "example-robot-data"\nextra = "robots"\n', "")
    with pytest.raises(UsageError, match=r"does not exist"):
        load_gripper(beside)
    outside = write(
        tmp_path, 'distribution = "example-robot-data"\nextra = "robots"\nfile = "cmeel', 'file = "../cmeel'
    )
    with pytest.raises(UsageError, match=r"lies outside the folder"):
        load_gripper(outside)


def test_own_urdf_with_meshes_loads_and_its_meshes_stay_inside(tmp_path: Path) -> None:
    trimesh.creation.icosphere(2, 0.012).export(tmp_path / "tip.stl")
    mesh = '<geometry><mesh filename="{}"/></geometry>'
    links = ["palm", *(f"{side}{n}" for side in ("a", "b") for n in (1, 2))]
    text = "<robot name='r'>" + "".join(
        f"<link name='{name}'><collision>{mesh.format('package://hand/tip.stl' if name == 'a2' else 'tip.stl')}"
        "</collision></link>"
        for name in links
    )
    for child, parent, x_m in (("a1", "palm", -0.04), ("a2", "a1", 0), ("b1", "palm", 0.04), ("b2", "b1", 0)):
        text += (
            f"<joint name='j_{child}' type='revolute'><parent link='{parent}'/><child link='{child}'/>"
            f"<origin xyz='{x_m} 0 0.03'/><axis xyz='0 1 0'/><limit lower='-1' upper='1'/></joint>"
        )
    folder = tmp_path / "hand"
    folder.mkdir()
    (tmp_path / "tip.stl").rename(folder / "tip.stl")
    (folder / "hand.urdf").write_text(text + "</robot>")
    (folder / "hand.toml").write_text(OWN_HAND)
    hand = load_gripper(str(folder / "hand.toml"))
    assert isinstance(hand, MultiFingerGripper)
    assert hand.links[0].name == "palm"
    assert len(hand.boxes(0.02)) == 5
    assert hand.links[1].shapes[0].bounding_box()[1] == pytest.approx([0.012] * 3, rel=0.01)
    (folder / "hand.urdf").write_text(
        (folder / "hand.urdf").read_text().replace('"tip.stl"', '"../../tip.stl"') + "</robot>"
    )
    with pytest.raises(UsageError):
        load_gripper(str(folder / "hand.toml"))


OWN_HAND = """
kind = "multi_finger"
name = "own"
source = "a test"
tip_depth_m = 0.06
force_n = 5.0
finger_friction = 1.0
palm_front_m = 0.01
clearance_m = 0.01
joints = ["j_a1", "j_a2", "j_b1", "j_b2"]
fingers = [["a1", "a2"], ["b1", "b2"]]
[urdf]
file = "hand.urdf"
[root_to_gripper]
position_m = [0.0, 0.0, 0.0]
quaternion_wxyz = [1.0, 0.0, 0.0, 0.0]
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
openings_m = [0.006, 0.056]
joints_rad = [[1.0, 0.0, -1.0, 0.0], [0.0, 0.0, 0.0, 0.0]]
"""
