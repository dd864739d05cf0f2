"""Robots by name or by file."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from manitwin.errors import ConfigError
from manitwin.formats.bounded_file import read_bytes
from manitwin.geometry.poses import inverse
from manitwin.robots.assembly import (
    SIDES,
    finger_joint,
    fix_other_joints,
    generated_hand,
    limits_of,
    mount,
    palm_link,
    settle_arm_joints,
    settle_finger_joints,
)
from manitwin.robots.definition import (
    MAX_FILE_BYTES,
    GeneratedHand,
    MergedHand,
    RobotDefinition,
    definition_path,
    read_definition,
    shipped_robots,
    urdf_files,
)
from manitwin.robots.disabled_pairs import disabled_pairs
from manitwin.robots.grippers.gripper import load_gripper, of_kind
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.links import links_of_urdf, poses_at
from manitwin.robots.robot import Robot
from manitwin.robots.urdf import UrdfTree, child_of, parent_of, read_urdf

__all__ = ["load_robot", "shipped_robots"]

AXIS_TOLERANCE = 1e-3
TIP_TOLERANCE_M = (
    0.015  # of the fingers' furthest point, against the gripper's file: a twisted or shifted hand is off by more
)


@dataclass(frozen=True)
class _Hand:
    """The hand's place in the whole tree."""

    tip_link: str
    finger_joints: tuple[str, str]
    gripper_to_tip: np.ndarray


def load_robot(name_or_path: str) -> Robot:
    """Load a robot by its shipped name or from a TOML file.

    Raises ConfigError naming the file, what is wrong and what would be valid; Unavailable where the robot's files come with
    an extra that is not installed.
    """
    path = definition_path(name_or_path)
    return _load_shipped(path) if name_or_path in shipped_robots() else _load(path)


@lru_cache
def _load_shipped(path: Path) -> Robot:
    return _load(path)


def _load(path: Path) -> Robot:
    definition, sha256 = read_definition(path)
    gripper = _gripper(definition.hand.gripper, path.parent)
    files = urdf_files(definition.urdf, path.parent, definition.name)
    tree = _read_tree(files.urdf)
    tree.keep_below(definition.base_link)
    names_in_files = tree.text()
    tree.use_meshes(files.mesh)
    hand, hand_names_in_files = _mount_hand(tree, definition, gripper, path.parent)
    settle_arm_joints(tree, definition.arm_joints, hand.tip_link, definition.limits_rad)
    settle_finger_joints(tree, hand.finger_joints, gripper.opening_m / 2)
    fix_other_joints(tree, definition.arm_joints + hand.finger_joints, definition.fixed_joints)
    _check_home(tree, definition)
    palm = _palm(tree, hand.finger_joints)
    meshes = b"".join(read_bytes(mesh, MAX_FILE_BYTES, ConfigError, name=str(mesh)) for mesh in tree.collision_meshes())
    parts = (sha256, gripper.sha256, names_in_files, hand_names_in_files, hashlib.sha256(meshes).hexdigest())
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
        hand_links=tree.below(palm),
        finger_links=(child_of(tree.joint(hand.finger_joints[0])), child_of(tree.joint(hand.finger_joints[1]))),
        disabled_pairs=disabled_pairs(tree, files.srdf, definition, hand.finger_joints),
        home_rad=np.array(definition.home_rad),
        velocity_limits_rad_s=definition.velocity_fraction * limits_of(tree, definition.arm_joints, "velocity"),
        acceleration_limits_rad_s2=np.full(len(definition.arm_joints), definition.acceleration_rad_s2),
        workspace=definition.workspace,
    )
    _check_hand(robot)
    return robot


def _read_tree(path: Path) -> UrdfTree:
    """Read a URDF without its transmissions, plugins and controllers."""
    tree = read_urdf(path)
    for element in list(tree.element):
        if element.tag not in ("link", "joint", "material"):
            tree.element.remove(element)
    return tree


def _gripper(name: str, folder: Path) -> ParallelGripper:
    if name.endswith(".toml"):
        path = (folder / name).resolve()
        if not path.is_relative_to(folder.resolve()) or not path.is_file():
            raise ConfigError(f"gripper file {name} is not below {folder}; put it there, or name one of the shipped")
        return of_kind(load_gripper(str(path)), ParallelGripper)
    return of_kind(load_gripper(name), ParallelGripper)


def _mount_hand(
    tree: UrdfTree, definition: RobotDefinition, gripper: ParallelGripper, folder: Path
) -> tuple[_Hand, str]:
    """Add the hand to the arm's tree, and return where it is and its URDF with the meshes' names as the file has them."""
    hand = definition.hand
    if isinstance(hand, GeneratedHand):
        added = generated_hand(gripper, hand.mass_kg)
        mount(tree, added, hand.mount_link, palm_link(gripper.name), hand.gripper_to_mount.matrix())
        plus, minus = (finger_joint(gripper.name, side) for side, _ in SIDES)
        return _Hand(palm_link(gripper.name), (plus, minus), np.eye(4)), added.text()
    names_in_files = ""
    if isinstance(hand, MergedHand):
        files = urdf_files(hand.urdf, folder, definition.name)
        added = _read_tree(files.urdf)
        added.keep_below(hand.root_link)
        names_in_files = added.text()
        added.use_meshes(files.mesh)
        mount(tree, added, hand.mount_link, hand.root_link, hand.root_to_mount.matrix())
    tree.link(hand.tip_link)
    return _Hand(hand.tip_link, hand.finger_joints, hand.gripper_to_tip.matrix()), names_in_files


def _palm(tree: UrdfTree, finger_joints: tuple[str, str]) -> str:
    first, second = (parent_of(tree.joint(name)) for name in finger_joints)
    if first != second:
        raise ConfigError(f"{tree.name}: the fingers hang from {first} and {second}; they must hang from one link")
    return first


def _check_home(tree: UrdfTree, definition: RobotDefinition) -> None:
    for name, value in zip(definition.arm_joints, definition.home_rad, strict=True):
        lower, upper = (float(limits_of(tree, (name,), key)[0]) for key in ("lower", "upper"))
        if not lower <= value <= upper:
            raise ConfigError(
                f"robot {definition.name}: home_rad of {name} is {value:g}; its limits are {lower:g} to {upper:g}"
            )


def _check_hand(robot: Robot) -> None:
    """Raise ConfigError where the fingers do not close along X or do not end where the gripper's file says."""
    links = links_of_urdf(robot.urdf)
    poses = poses_at(links, {})
    to_grasp = inverse(poses[robot.tip_link] @ robot.gripper_to_tip)
    furthest_m = []
    for joint, sign in zip(robot.finger_joints, (1, -1), strict=True):
        link = next(link for link in links if link.joint == joint)
        axis = to_grasp[:3, :3] @ poses[link.name][:3, :3] @ link.joint_to_link[:3, 0]
        if abs(sign * axis[0] - 1) > AXIS_TOLERANCE:
            raise ConfigError(
                f"robot {robot.name}: {joint} opens along {axis.round(3).tolist()} of the grasp frame, not along "
                f"{'+X' if sign > 0 else '-X'}; mend gripper_to_tip or the order of finger_joints"
            )
        for shape in link.shapes:
            box_to_link, half_m = shape.bounding_box()
            box = to_grasp @ poses[link.name] @ box_to_link
            furthest_m.append(float(box[2, 3] + np.abs(box[2, :3]) @ half_m))
    if not furthest_m:
        raise ConfigError(f"robot {robot.name}: its fingers have no collision shapes; give them some")
    wanted_m = robot.gripper.tip_depth_m + robot.gripper.pad_half_extents_m[1]
    if abs(max(furthest_m) - wanted_m) > TIP_TOLERANCE_M:
        raise ConfigError(
            f"robot {robot.name}: its fingers end {max(furthest_m):.4f} m along +Z of the grasp frame, the gripper's at "
            f"{wanted_m:.4f}; mend gripper_to_tip or name another gripper"
        )
