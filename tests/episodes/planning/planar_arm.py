"""An arm of three parallel joints whose kinematics is closed, with a hand of two fingers."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.poses import transform
from manitwin.robots.grippers.gripper import load_gripper, require_kind
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.robot import Robot, Workspace

LENGTHS_M = (0.4, 0.3, 0.2)


def planar_arm(kind: str = "revolute", limit_rad: float = 3.0) -> Robot:
    """Links of 0.4, 0.3 and 0.2 m that turn about +Z in the plane z = 0.5; the grasp frame points along the last one."""
    urdf = f"""<robot name="planar">
      <link name="base"/>
      {_link("a", LENGTHS_M[0])}{_link("b", LENGTHS_M[1])}{_link("c", LENGTHS_M[2])}{_finger("left")}{_finger("right")}
      {_joint("q1", "base", "a", "0 0 0.5", kind, limit_rad)}
      {_joint("q2", "a", "b", f"{LENGTHS_M[0]} 0 0", kind, limit_rad)}
      {_joint("q3", "b", "c", f"{LENGTHS_M[1]} 0 0", kind, limit_rad)}
      {_slide("f1", "left", "0 1 0")}{_slide("f2", "right", "0 -1 0")}
    </robot>"""
    along_x = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # approaches along the link's x, closes along its y
    return Robot(
        name="planar",
        sha256="0" * 64,
        source="a test",
        urdf=urdf,
        arm_joints=("q1", "q2", "q3"),
        finger_joints=("f1", "f2"),
        tip_link="c",
        gripper_to_tip=transform(along_x, np.array([LENGTHS_M[2], 0, 0])),
        gripper=require_kind(load_gripper("panda"), ParallelGripper),
        hand_links=("c",),
        finger_links=("left", "right"),
        disabled_pairs=(("base", "a"), ("a", "b"), ("b", "c"), ("c", "left"), ("c", "right"), ("left", "right")),
        home_rad=np.array([0.1, 0.2, 0.3]),
        velocity_limits_rad_s=np.array([1.0, 1.5, 2.0]),
        fastest_rad_s=np.array([1.0, 1.5, 2.0]),
        acceleration_limits_rad_s2=np.array([3.0, 4.0, 5.0]),
        workspace=Workspace(0.2, 0.8, 1.0),
    )


def _link(name: str, length_m: float) -> str:
    box = f'<box size="{length_m - 0.1} 0.04 0.04"/>'
    return f"""<link name="{name}"><collision><origin xyz="{length_m / 2} 0 0"/><geometry>{box}</geometry></collision>
      <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""


def _finger(name: str) -> str:
    return f"""<link name="{name}"><collision><geometry><box size="0.04 0.01 0.02"/></geometry></collision>
      <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""


def _joint(name: str, parent: str, child: str, origin: str, kind: str, limit_rad: float) -> str:
    limit = f'<limit lower="{-limit_rad}" upper="{limit_rad}" effort="9" velocity="2"/>' if kind == "revolute" else ""
    return f"""<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
      <origin xyz="{origin}"/><axis xyz="0 0 1"/>{limit}</joint>"""


def _slide(name: str, child: str, axis: str) -> str:
    return f"""<joint name="{name}" type="prismatic"><parent link="c"/><child link="{child}"/>
      <origin xyz="0.26 0 0"/><axis xyz="{axis}"/><limit lower="0" upper="0.04" effort="9" velocity="1"/></joint>"""
