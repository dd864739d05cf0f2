"""Loading of robots by name or from a definition file."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

import numpy as np

from manitwin.errors import ConfigError
from manitwin.formats.bounded_file import read_bytes
from manitwin.geometry.poses import inverse
from manitwin.robots.assembly import (
    configure_arm_joints,
    configure_finger_joints,
    fix_other_joints,
    joint_limits,
)
from manitwin.robots.definition import (
    MAX_FILE_BYTES,
    RobotDefinition,
    definition_path,
    read_definition,
    shipped_robots,
    shipped_two_arms,
    urdf_files,
)
from manitwin.robots.disabled_pairs import disabled_pairs
from manitwin.robots.grippers.gripper import Gripper, load_gripper
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.links import poses_at, read_urdf_links
from manitwin.robots.mounted_hands import MountedHand, mount_hand, read_arm
from manitwin.robots.robot import Robot
from manitwin.robots.two_arms import is_two_arm_file, load_two_arms
from manitwin.robots.urdf import UrdfTree, parent_of

__all__ = ["load_robot", "shipped_robots", "shipped_two_arms"]

AXIS_TOLERANCE = 1e-3
TIP_TOLERANCE_M = 0.015
"""Tolerance of the fingers' most distal point against the gripper file; a rotated or shifted hand deviates by more."""


def load_robot(name_or_path: str) -> Robot:
    """Load a robot by its shipped name or from a TOML file.

    Raises ConfigError naming the file, the problem and valid values; Unavailable if the robot's files belong to an extra that
    is not installed.
    """
    path = definition_path(name_or_path)
    return _load_shipped(path) if not name_or_path.endswith(".toml") else _load(path)


@lru_cache
def _load_shipped(path: Path) -> Robot:
    return _load(path)


def _load(path: Path) -> Robot:
    if is_two_arm_file(path):
        return load_two_arms(path, lambda name: _load_one_arm(_resolve_name(name, path.parent), path))
    definition, sha256 = read_definition(path)
    gripper = _gripper(definition.hand.gripper, path.parent)
    files = urdf_files(definition.urdf, path.parent, definition.name)
    tree = read_arm(files.urdf)
    tree.keep_subtree(definition.base_link)
    names_in_files = tree.text()
    tree.set_mesh_paths(files.mesh)
    hand = mount_hand(tree, definition, gripper, path.parent)
    configure_arm_joints(tree, definition.arm_joints, hand.tip_link, definition.limits_rad)
    if isinstance(gripper, ParallelGripper):
        first, second = hand.finger_joints
        configure_finger_joints(tree, (first, second), gripper.opening_m / 2)
    fix_other_joints(tree, definition.arm_joints + hand.finger_joints, definition.fixed_joints)
    _check_home(tree, definition)
    palm = _palm(tree, hand, gripper)
    meshes = b"".join(read_bytes(mesh, MAX_FILE_BYTES, ConfigError, name=str(mesh)) for mesh in tree.collision_meshes())
    parts = (sha256, gripper.sha256, names_in_files, hand.names_in_files, hashlib.sha256(meshes).hexdigest())
    robot = Robot(
        name=definition.name,
        sha256=hashlib.sha256("\n".join(parts).encode()).hexdigest(),
        source=definition.source,
        urdf=tree.text(),
        arm_joints=definition.arm_joints,
        finger_joints=hand.finger_joints,
        tip_link=hand.tip_link,
        gripper_to_tip=hand.gripper_to_tip,
        gripper=gripper,
        hand_links=tree.subtree_links(palm),
        finger_links=hand.finger_links,
        disabled_pairs=disabled_pairs(tree, files.srdf, definition, palm),
        home_rad=np.array(definition.home_rad),
        velocity_limits_rad_s=definition.velocity_fraction * joint_limits(tree, definition.arm_joints, "velocity"),
        acceleration_limits_rad_s2=np.full(len(definition.arm_joints), definition.acceleration_rad_s2),
        workspace=definition.workspace,
        fastest_rad_s=joint_limits(tree, definition.arm_joints, "velocity"),
    )
    if isinstance(gripper, ParallelGripper):
        _check_jaws(robot, gripper)
    return robot


def _load_one_arm(name_or_path: str, wanted_by: Path) -> Robot:
    if is_two_arm_file(definition_path(name_or_path)):
        raise ConfigError(f"robot file {wanted_by}: {name_or_path} has two arms itself; name a robot with one arm")
    return load_robot(name_or_path)


def _gripper(name: str, folder: Path) -> Gripper:
    return load_gripper(_resolve_name(name, folder, "gripper"))


def _resolve_name(name: str, folder: Path, kind: str = "robot") -> str:
    """Return a shipped name unchanged, or the path of a named file below a folder; raises ConfigError if it is missing."""
    if not name.endswith(".toml"):
        return name
    path = (folder / name).resolve()
    if not path.is_relative_to(folder.resolve()) or not path.is_file():
        raise ConfigError(f"{kind} file {name} is not below {folder}; put it there, or name one of the shipped")
    return str(path)


def _palm(tree: UrdfTree, hand: MountedHand, gripper: Gripper) -> str:
    if not isinstance(gripper, ParallelGripper):
        return hand.tip_link
    finger_joints = hand.finger_joints
    first, second = (parent_of(tree.joint(name)) for name in finger_joints)
    if first != second:
        raise ConfigError(f"{tree.name}: the fingers hang from {first} and {second}; they must hang from one link")
    return first


def _check_home(tree: UrdfTree, definition: RobotDefinition) -> None:
    for name, value in zip(definition.arm_joints, definition.home_rad, strict=True):
        lower, upper = (float(joint_limits(tree, (name,), key)[0]) for key in ("lower", "upper"))
        if not lower <= value <= upper:
            raise ConfigError(
                f"robot {definition.name}: home_rad of {name} is {value:g}; its limits are {lower:g} to {upper:g}"
            )


def _check_jaws(robot: Robot, gripper: ParallelGripper) -> None:
    """Raise ConfigError unless the fingers open along X and end where the gripper file says."""
    links = read_urdf_links(robot.urdf)
    poses = poses_at(links, {})
    to_grasp = inverse(poses[robot.tip_link] @ robot.gripper_to_tip)
    furthest_m = []
    for joint, sign in zip(robot.finger_joints, (1, -1), strict=True):
        link = next(link for link in links if link.joint == joint)
        axis = to_grasp[:3, :3] @ poses[link.name][:3, :3] @ link.joint_to_link[:3, 0]
        if abs(sign * axis[0] - 1) > AXIS_TOLERANCE:
            raise ConfigError(
                f"robot {robot.name}: {joint} opens along {axis.round(3).tolist()} of the grasp frame, not along "
                f"{'+X' if sign > 0 else '-X'}; correct gripper_to_tip or the order of finger_joints"
            )
        for shape in link.shapes:
            box_to_link, half_m = shape.bounding_box()
            box = to_grasp @ poses[link.name] @ box_to_link
            furthest_m.append(float(box[2, 3] + np.abs(box[2, :3]) @ half_m))
    if not furthest_m:
        raise ConfigError(f"robot {robot.name}: its fingers have no collision shapes; add some")
    wanted_m = gripper.tip_depth_m + gripper.pad_half_extents_m[1]
    if abs(max(furthest_m) - wanted_m) > TIP_TOLERANCE_M:
        raise ConfigError(
            f"robot {robot.name}: its fingers end {max(furthest_m):.4f} m along +Z of the grasp frame, the gripper's at "
            f"{wanted_m:.4f}; correct gripper_to_tip or name another gripper"
        )
