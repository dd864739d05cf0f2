"""A hand mounted on an arm: links made of a parallel gripper's boxes, or the links of another URDF."""

from __future__ import annotations

import copy

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.errors import UsageError
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.robots.grippers.box import PlacedBox
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.joints import set_origin
from manitwin.robots.urdf_tree import UrdfTree

SIDES = (("plus", 1), ("minus", -1))
_GREY = "0.25 0.25 0.27 1"


def mount(tree: UrdfTree, hand: UrdfTree, mount_link: str, root_link: str, root_to_mount: np.ndarray) -> None:
    """Hang all links of ``hand`` below ``mount_link`` of the arm's tree, fixed at ``root_to_mount (4, 4)``.

    Raises UsageError where the link is not there, or a name is in both.
    """
    tree.link(mount_link)
    for kind, mine, theirs in (("link", tree.links, hand.links), ("joint", tree.joints, hand.joints)):
        twice = sorted(set(mine) & set(theirs))
        if twice:
            raise UsageError(
                f"{hand.name}: {kind} names {', '.join(twice)} are also the arm's; rename them in one URDF"
            )
    for element in hand.element:
        tree.element.append(copy.deepcopy(element))
    joint = _joint(tree.element, f"{root_link}_mount", "fixed", mount_link, root_link)
    set_origin(joint, root_to_mount)


def generated_hand(gripper: ParallelGripper, mass_kg: float) -> UrdfTree:
    """Return a gripper's boxes as a URDF of a palm and two prismatic fingers; the palm's frame is the grasp frame.

    The mass is shared out by the boxes' volumes: a hand's file has none.
    """
    name = gripper.name
    robot = etree.Element("robot", name=name)
    palm = [box.placed() for box in gripper.palm_boxes]
    fingers = {side: [box.placed(0.0, sign) for box in gripper.finger_boxes] for side, sign in SIDES}
    density = mass_kg / sum(_volume(boxes) for boxes in (palm, *fingers.values()))
    _link(robot, palm_link(name), palm, density)
    for side, sign in SIDES:
        _link(robot, finger_link(name, side), fingers[side], density)
        joint = _joint(robot, finger_joint(name, side), "prismatic", palm_link(name), finger_link(name, side))
        set_origin(joint, np.eye(4))
        etree.SubElement(joint, "axis", xyz=f"{sign} 0 0")
        half_m = repr(gripper.opening_m / 2)
        etree.SubElement(joint, "limit", lower="0", upper=half_m, velocity="0.1", effort=repr(gripper.force_n))
    return UrdfTree(f"hand generated of gripper {name}", robot)


def palm_link(gripper: str) -> str:
    """Return the name of a generated hand's palm."""
    return f"{gripper}_palm"


def finger_link(gripper: str, side: str) -> str:
    """Return the name of a generated hand's finger on the ``plus`` or ``minus`` side of X."""
    return f"{gripper}_finger_{side}"


def finger_joint(gripper: str, side: str) -> str:
    """Return the name of the joint that moves that finger."""
    return f"{finger_link(gripper, side)}_joint"


def _volume(boxes: list[PlacedBox]) -> float:
    return float(sum(8 * half.prod() for _, half in boxes))


def _joint(robot: etree._Element, name: str, kind: str, parent: str, child: str) -> etree._Element:
    joint = etree.SubElement(robot, "joint", name=name, type=kind)
    etree.SubElement(joint, "parent", link=parent)
    etree.SubElement(joint, "child", link=child)
    return joint


def _link(robot: etree._Element, name: str, boxes: list[PlacedBox], density_kg_m3: float) -> None:
    link = etree.SubElement(robot, "link", name=name)
    for box_to_link, half_m in boxes:
        for tag in ("visual", "collision"):
            shape = etree.SubElement(link, tag)
            set_origin(shape, box_to_link)
            size = " ".join(repr(float(2 * half)) for half in half_m)
            etree.SubElement(etree.SubElement(shape, "geometry"), "box", size=size)
            if tag == "visual":
                material = etree.SubElement(shape, "material", name=f"{name}_grey")
                etree.SubElement(material, "color", rgba=_GREY)
    _inertial(link, boxes, density_kg_m3)


def _inertial(link: etree._Element, boxes: list[PlacedBox], density_kg_m3: float) -> None:
    """Write the mass properties of boxes of one density (Steiner's theorem), overlaps counted twice."""
    masses = np.array([density_kg_m3 * 8 * half.prod() for _, half in boxes])
    centers = np.array([pose[:3, 3] for pose, _ in boxes])
    center = masses @ centers / masses.sum()
    tensor = np.zeros((3, 3))
    for mass, (pose, half) in zip(masses, boxes, strict=True):
        own = np.diag(half @ half - half**2) * mass / 3
        offset = transform_points(inverse(transform(translation=center)), pose[None, :3, 3])[0]
        tensor += pose[:3, :3] @ own @ pose[:3, :3].T + mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    inertial = etree.SubElement(link, "inertial")
    set_origin(inertial, transform(translation=center))
    etree.SubElement(inertial, "mass", value=repr(float(masses.sum())))
    keys = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    etree.SubElement(inertial, "inertia", {key: repr(float(tensor[at])) for key, at in keys.items()})
