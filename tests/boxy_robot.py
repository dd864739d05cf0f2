"""A robot whose looks are boxes: three joints and a generated hand; and recordings of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from manitwin.episodes.recording import Recording
from manitwin.episodes.replay_pictures import link_poses
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.robots.load import load_robot
from manitwin.robots.robot import Robot


def _link(name: str, size: str, xyz: str) -> str:
    shape = f'<origin xyz="{xyz}"/><geometry><box size="{size}"/></geometry>'
    return f'<link name="{name}"><visual>{shape}<material name="blue"/></visual><collision>{shape}</collision></link>'


URDF = f"""<robot name="boxy">
  <material name="blue"><color rgba="0.1 0.2 0.9 1"/></material>
  {_link("base", "0.1 0.1 0.3", "0 0 0.15")}
  <joint name="turn" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.4"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="2" effort="10"/></joint>
  {_link("upper", "0.25 0.05 0.05", "0.2 0 0")}
  <joint name="lift" type="revolute"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="2" effort="10"/></joint>
  {_link("fore", "0.1 0.05 0.05", "0.1 0 0")}
  <joint name="roll" type="revolute"><parent link="fore"/><child link="flange"/>
    <origin xyz="0.2 0 0" rpy="0 1.5707963267948966 0"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="3" effort="10"/></joint>
  <link name="flange"/>
</robot>"""

TOML = """name = "boxy"
source = "made for a test"
base_link = "base"
arm_joints = ["turn", "lift", "roll"]
home_rad = [0.0, 1.0, 0.0]
velocity_fraction = 0.5
acceleration_rad_s2 = 3.0
[urdf]
file = "boxy.urdf"
[hand]
kind = "generated"
gripper = "panda"
mount_link = "flange"
mass_kg = 0.7
[hand.gripper_to_mount]
position_m = [0.0, 0.0, 0.0]
quaternion_wxyz = [1.0, 0.0, 0.0, 0.0]
[workspace]
min_radius_m = 0.3
max_radius_m = 0.6
half_angle_rad = 1.0
"""


def boxy_robot(folder: Path) -> Robot:
    (folder / "boxy.urdf").write_text(URDF)
    (folder / "boxy.toml").write_text(TOML)
    return load_robot(str(folder / "boxy.toml"))


def moving(robot: Robot, steps: int, objects: np.ndarray) -> Recording:
    """A recording in which all joints move, the hand opens and closes, and objects ``(N, 3)`` stand still."""
    time = np.linspace(0, 1, steps + 1)[:, None]
    joints = robot.home_rad + 0.3 * np.sin(2 * np.pi * time + np.arange(len(robot.arm_joints)))
    tips = np.array([tip_pose(robot, each) for each in joints])
    count = len(objects)

    def zeros(*shape: int) -> np.ndarray:
        return np.zeros((steps + 1, *shape), np.float32)

    return Recording(
        target=0,
        joint_positions_rad=joints.astype(np.float32),
        joint_velocities_rad_s=zeros(joints.shape[1]),
        hand=(0.04 + 0.03 * np.sin(5 * time)).astype(np.float32),
        tip_position_m=tips[:, :3, 3].astype(np.float32),
        tip_quaternion_wxyz=quaternion_wxyz(tips[:, :3, :3]).astype(np.float32),
        object_positions_m=np.tile(objects.astype(np.float32), (steps + 1, 1, 1)),
        object_quaternions_wxyz=np.tile(np.array([1, 0, 0, 0], np.float32), (steps + 1, count, 1)),
        object_linear_velocities_m_s=zeros(count, 3),
        object_angular_velocities_rad_s=zeros(count, 3),
        finger_forces_n=zeros(2),
        target_on_support=zeros().astype(bool),
        unplanned_contact=zeros().astype(bool),
        action_joint_positions_rad=joints[1:].astype(np.float32),
        action_hand=zeros(1)[1:],
        action_tip_position_m=zeros(3)[1:],
        action_tip_quaternion_wxyz=zeros(4)[1:],
        phase=np.zeros(steps, np.uint8),
    )


def tip_pose(robot: Robot, joint_positions_rad: np.ndarray) -> np.ndarray:
    """Return ``gripper_to_world (4, 4)`` of the grasp frame (+Z approach, X closing)."""
    return (
        link_poses(robot, joint_positions_rad, np.zeros(len(robot.hand_state_names)))[robot.tip_link]
        @ robot.gripper_to_tip
    )
