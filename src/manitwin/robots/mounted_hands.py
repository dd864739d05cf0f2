"""Mounting of the hand on the arm, for each kind of hand in a robot file: its links, joints and grasp frame in the whole tree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.errors import ConfigError
from manitwin.formats.xml_file import add
from manitwin.geometry.poses import inverse
from manitwin.robots.assembly import SIDES, finger_joint, finger_link, generated_hand, mount, palm_link
from manitwin.robots.definition import DescribedHand, GeneratedHand, MergedHand, RobotDefinition, urdf_files
from manitwin.robots.generated_cup import cup_joint, cup_link, generated_cup
from manitwin.robots.grippers.gripper import Gripper, require_kind
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.grippers.suction import SuctionGripper
from manitwin.robots.urdf import UrdfTree, child_of, geometry_of, origin_of, set_origin
from manitwin.robots.urdf_reader import HAND, read_urdf


@dataclass(frozen=True)
class MountedHand:
    """The hand's links and joints in the whole tree; ``names_in_files`` is its URDF with mesh names as in the file.

    ``gripper_to_tip (4, 4)`` is the grasp frame in the frame of ``tip_link``.
    """

    tip_link: str
    finger_joints: tuple[str, ...]
    finger_links: tuple[str, ...]
    gripper_to_tip: np.ndarray
    names_in_files: str = ""


def mount_hand(tree: UrdfTree, definition: RobotDefinition, gripper: Gripper, folder: Path) -> MountedHand:
    """Add the hand to the arm's tree, in place.

    Raises ConfigError for invalid links or names, UsageError for a gripper of the wrong kind.
    """
    hand = definition.hand
    if isinstance(hand, DescribedHand):
        return _mount_described(tree, hand, require_kind(gripper, MultiFingerGripper))
    if isinstance(hand, GeneratedHand) and isinstance(gripper, SuctionGripper):
        added = generated_cup(gripper, hand.mass_kg)
        mount(tree, added, hand.mount_link, palm_link(gripper.name), hand.gripper_to_mount.matrix())
        lip = (cup_joint(gripper.name),), (cup_link(gripper.name),)
        return MountedHand(palm_link(gripper.name), *lip, np.eye(4), added.text())
    jaws = require_kind(gripper, ParallelGripper)
    if isinstance(hand, GeneratedHand):
        added = generated_hand(jaws, hand.mass_kg)
        mount(tree, added, hand.mount_link, palm_link(jaws.name), hand.gripper_to_mount.matrix())
        joints = tuple(finger_joint(jaws.name, side) for side, _ in SIDES)
        links = tuple(finger_link(jaws.name, side) for side, _ in SIDES)
        return MountedHand(palm_link(jaws.name), joints, links, np.eye(4), added.text())
    names_in_files = ""
    if isinstance(hand, MergedHand):
        files = urdf_files(hand.urdf, folder, definition.name)
        added = read_arm(files.urdf)
        added.keep_subtree(hand.root_link)
        names_in_files = added.text()
        added.set_mesh_paths(files.mesh)
        mount(tree, added, hand.mount_link, hand.root_link, hand.root_to_mount.matrix())
    tree.link(hand.tip_link)
    links = tuple(child_of(tree.joint(name)) for name in hand.finger_joints)
    return MountedHand(hand.tip_link, hand.finger_joints, links, hand.gripper_to_tip.matrix(), names_in_files)


def read_arm(path: Path) -> UrdfTree:
    """Read a URDF, keeping only links, joints and materials."""
    return _keep_kinematics(read_urdf(path))


def _keep_kinematics(tree: UrdfTree) -> UrdfTree:
    for element in list(tree.element):
        if element.tag not in ("link", "joint", "material"):
            tree.element.remove(element)
    return tree


def _mount_described(tree: UrdfTree, hand: DescribedHand, gripper: MultiFingerGripper) -> MountedHand:
    added = _keep_kinematics(read_urdf(gripper.urdf_path, HAND))
    (root,) = added.roots()
    names_in_files = added.text()
    _find_meshes(added, gripper.mesh_path)
    root_to_mount = hand.gripper_to_mount.matrix() @ gripper.root_to_gripper
    mount(tree, added, hand.mount_link, root, root_to_mount)
    fingers = tuple(name for links in gripper.fingers for name in links)
    return MountedHand(root, gripper.joints, (root, *fingers), inverse(gripper.root_to_gripper), names_in_files)


def _find_meshes(tree: UrdfTree, find_mesh: Callable[[str], Path]) -> None:
    """Write the meshes' absolute paths; a link whose visual meshes are missing is displayed by its collision shapes."""
    for link in tree.element.findall("link"):
        for shape in (*link.findall("visual"), *link.findall("collision")):
            for mesh in shape.iter("mesh"):
                try:
                    mesh.set("filename", str(find_mesh(mesh.get("filename"))))
                except ConfigError:
                    if shape.tag == "collision":
                        raise
                    link.remove(shape)
        if link.find("visual") is None:
            for shape in link.findall("collision"):
                _add_visual(link, shape)


def _add_visual(link: etree._Element, collision: etree._Element) -> None:
    shape, looks = geometry_of(collision), add(link, "visual")
    set_origin(looks, origin_of(collision))
    add(add(looks, "geometry"), shape.tag, **dict(shape.attrib))
