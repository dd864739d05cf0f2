"""The robots that come with the package: their kinematics against MuJoCo's, and where their hands sit."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from lxml import etree

from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.suction import SuctionGripper
from manitwin.robots.links import poses_at, read_rigid_bodies, read_urdf_links
from manitwin.robots.load import load_robot, shipped_robots
from manitwin.robots.robot import Robot

FLANGES = {"panda": "panda_link8", "ur5_panda": "tool0", "ur5_robotiq": "tool0", "xarm7_panda": "link_eef"}
JAWS = sorted(FLANGES)


@pytest.fixture(params=shipped_robots())
def robot(request: pytest.FixtureRequest) -> Robot:
    return load_robot(request.param)


def _mujoco_model(robot: Robot) -> mujoco.MjModel:
    """The bare kinematics, read by MuJoCo's own URDF parser."""
    root = etree.fromstring(robot.urdf)
    for element in [*root.iter("visual", "collision", "inertial")]:
        element.getparent().remove(element)
    for link in root.iter("link"):
        inertial = etree.SubElement(link, "inertial")
        etree.SubElement(inertial, "mass", value="1")
        etree.SubElement(inertial, "inertia", ixx="1", iyy="1", izz="1", ixy="0", ixz="0", iyz="0")
    compiler = etree.SubElement(etree.SubElement(root, "mujoco"), "compiler")
    compiler.set("fusestatic", "false")
    return mujoco.MjModel.from_xml_string(etree.tostring(root, encoding="unicode"))


def test_links_are_where_mujoco_has_them(robot: Robot):
    model = _mujoco_model(robot)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(5)
    links = read_urdf_links(robot.urdf)
    for _ in range(5):
        joints = {}
        for name in (*robot.arm_joints, *robot.finger_joints):
            joint = model.joint(name)
            joints[name] = data.qpos[joint.qposadr[0]] = rng.uniform(*joint.range)
        mujoco.mj_kinematics(model, data)
        for name, pose in poses_at(links, joints).items():
            if name != links[0].name:  # MuJoCo's world
                assert np.allclose(data.body(name).xpos, pose[:3, 3], atol=1e-6)
                assert np.allclose(data.body(name).xmat.reshape(3, 3), pose[:3, :3], atol=1e-6)


@pytest.mark.parametrize("name", JAWS)
def test_hand_points_out_of_the_flange_and_its_tips_are_at_the_grippers_depth(name: str):
    robot = load_robot(name)
    links = read_urdf_links(robot.urdf)
    half_m = 0.01
    poses = poses_at(links, dict(zip(robot.finger_joints, (half_m, half_m), strict=True)))
    flange_to_grasp = inverse(poses[robot.tip_link] @ robot.gripper_to_tip) @ poses[FLANGES[robot.name]]
    assert np.allclose(flange_to_grasp[:3, 2], [0, 0, 1], atol=1e-8)
    assert np.allclose(flange_to_grasp[:3, 3], 0, atol=1e-8)
    to_grasp = inverse(poses[robot.tip_link] @ robot.gripper_to_tip)
    for name, sign in zip(robot.finger_links, (1, -1), strict=True):
        shapes = next(link.shapes for link in links if link.name == name)
        boxes = [(to_grasp @ poses[name] @ pose, half) for pose, half in (shape.bounding_box() for shape in shapes)]
        pad, half = max(boxes, key=lambda placed: placed[0][2, 3] + abs(placed[0][2, :3]) @ placed[1])
        assert abs(pad[2, 3] - robot.gripper.tip_depth_m) < 0.001
        inner_m = sign * pad[0, 3] - np.abs(pad[0, :3]) @ half
        assert abs(inner_m - half_m) < 0.0005  # the pads' faces are as far apart as the joints say


def test_a_cups_lip_lies_in_the_plane_of_its_file_and_is_as_wide():
    robot = load_robot("ur5_suction")
    assert isinstance(robot.gripper, SuctionGripper)
    lip = next(link for link in read_urdf_links(robot.urdf) if link.name == robot.finger_links[0])
    corners = np.concatenate([transform_points(shape.shape_to_link, shape.corners_m) for shape in lip.shapes])
    assert corners[:, 2].max() == pytest.approx(robot.gripper.tip_depth_m)
    assert np.linalg.norm(corners[:, :2], axis=1).max() == pytest.approx(robot.gripper.lip_radius_m)
    assert lip.limits == (-robot.gripper.reach_m, robot.gripper.reach_m)
    assert lip.joint_to_parent[:3, 0] == pytest.approx([0, 0, 1])  # the plunger runs along the approach


def test_fingers_of_a_mounted_hand_are_where_its_gripper_has_them():
    robot = load_robot("xarm7_allegro")
    assert isinstance(robot.gripper, MultiFingerGripper)
    joints = robot.gripper.postures[1].joints_at(np.array(0.03))
    poses = poses_at(read_urdf_links(robot.urdf), dict(zip(robot.finger_joints, joints.tolist(), strict=True)))
    to_grasp = inverse(poses[robot.tip_link] @ robot.gripper_to_tip)
    for link, pose in zip(robot.gripper.links, robot.gripper.link_poses(joints), strict=True):
        assert np.allclose(to_grasp @ poses[link.name], pose, atol=1e-9)
    assert (
        {robot.contact_side(name) for name in robot.gripper.fingers[0]}
        == {0}
        == {robot.contact_side(robot.hand_links[0])}
    )
    assert {robot.contact_side(name) for links in robot.gripper.fingers[1:] for name in links} == {1}
    assert robot.contact_side("link7") is None


def test_home_is_free_of_the_table_and_points_down(robot: Robot):
    poses = poses_at(read_urdf_links(robot.urdf), dict(zip(robot.arm_joints, robot.home_rad, strict=True)))
    grasp = poses[robot.tip_link] @ robot.gripper_to_tip
    assert grasp[2, 2] < -0.99
    tips_m = grasp[:3, 3] + robot.gripper.tip_depth_m * grasp[:3, 2]
    assert tips_m[2] > 0.2
    assert robot.workspace.min_radius_m < np.hypot(*tips_m[:2]) < robot.workspace.max_radius_m


def test_bodies_have_the_inertias_that_pinocchio_joins(robot: Robot):
    bodies, part_of = read_rigid_bodies(robot.urdf, robot.hand_links[0])
    model = pin.buildModelFromXML(robot.urdf)
    hand = part_of[robot.hand_links[0]][0]
    by_joint = {body.joint: body for body in bodies if body.joint_type != "fixed"}
    for name, inertia in zip(model.names[1:], model.inertias[1:], strict=True):
        body = by_joint[name]
        with_hand = name == robot.arm_joints[-1]  # the hand is a body of its own here
        palm = next(one for one in bodies if one.name == hand)
        assert np.isclose(inertia.mass, body.mass_kg + (palm.mass_kg if with_hand else 0.0))
        if not with_hand:
            tensor = body.principal_axes @ np.diag(body.moments_kg_m2) @ body.principal_axes.T
            # pin's frame of a joint is the URDF link's own
            assert np.allclose(inertia.lever, body.center_of_mass_m, atol=1e-9)
            assert np.allclose(inertia.inertia, tensor, atol=1e-9)


def test_generated_hand_weighs_what_its_file_says_and_balances_on_the_approach_axis():
    bodies, _ = read_rigid_bodies(load_robot("ur5_robotiq").urdf, "robotiq_2f85_palm")
    hand = [body for body in bodies if body.name.startswith("robotiq")]
    masses = np.array([body.mass_kg for body in hand])
    centers = np.array([body.center_of_mass_m for body in hand])
    assert np.isclose(masses.sum(), 0.9)
    assert np.allclose((masses @ centers)[:2], 0, atol=1e-12)


def test_generated_inertia_of_one_box_is_the_closed_form():
    from manitwin.robots.assembly import generated_hand
    from manitwin.robots.grippers.box import Box
    from manitwin.robots.grippers.parallel import ParallelGripper

    cube = Box((0.0, 0.0, 0.05), (0.01, 0.02, 0.03))
    gripper = ParallelGripper("g", "", 0.1, 0.1, 1.0, 1.0, (0.01, 0.01), (cube,), (cube,), "")
    inertial = generated_hand(gripper, 0.3).link("g_palm").find("inertial")
    assert np.isclose(float(inertial.find("mass").get("value")), 0.1)
    moments = [float(inertial.find("inertia").get(key)) for key in ("ixx", "iyy", "izz")]
    a, b, c = 0.02, 0.04, 0.06
    assert np.allclose(moments, 0.1 / 12 * np.array([b * b + c * c, a * a + c * c, a * a + b * b]))
    assert np.allclose([float(word) for word in inertial.find("origin").get("xyz").split()], [0, 0, 0.05])


def test_loading_twice_gives_the_same_robot(robot: Robot):
    from manitwin.robots import load

    again = load._load(load.definition_path(robot.name))
    assert (again.sha256, again.urdf, again.disabled_pairs) == (robot.sha256, robot.urdf, robot.disabled_pairs)


def test_velocity_limits_are_half_of_those_of_the_manual():
    # Franka Emika Robot and Interface Specifications: 2.1750 rad/s for joints 1 to 4, 2.6100 for 5 to 7
    assert np.allclose(load_robot("panda").velocity_limits_rad_s, [1.0875] * 4 + [1.305] * 3)


def test_panda_grasp_frame_is_a_quarter_turn_of_its_hand():
    assert np.allclose(load_robot("panda").gripper_to_tip, transform(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])))
