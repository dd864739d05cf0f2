"""Assembly of arm and hand into one URDF, with the joint types that planner and simulation support.

The result has n revolute arm joints and the joints of the hand; all others are fixed. The hand's links come from another URDF
or are generated from the boxes of a parallel gripper.
"""

from __future__ import annotations

import copy

import numpy as np
from lxml import etree  # type: ignore[import-untyped]
from scipy.spatial.transform import Rotation

from manitwin.errors import ConfigError
from manitwin.formats.xml_file import add, new_element
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.robots.grippers.box import PlacedBox
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.urdf import UrdfTree, child_of, origin_of, parent_of, set_origin, values_of

REACH_TOLERANCE_M = 1e-4
SIDES = (("plus", 1), ("minus", -1))
_GREY = "0.25 0.25 0.27 1"


def mount(tree: UrdfTree, hand: UrdfTree, mount_link: str, root_link: str, root_to_mount: np.ndarray) -> None:
    """Attach all links of ``hand`` below ``mount_link`` of the arm's tree by a fixed joint at ``root_to_mount (4, 4)``.

    Raises ConfigError if ``mount_link`` does not exist, or if a link or joint name occurs in both trees.
    """
    tree.link(mount_link)
    for kind, mine, theirs in (("link", tree.links, hand.links), ("joint", tree.joints, hand.joints)):
        twice = sorted(set(mine) & set(theirs))
        if twice:
            raise ConfigError(
                f"{hand.name}: {kind} names {', '.join(twice)} are also the arm's; rename them in the arm's URDF (a renamed"
                " hand is another gripper than the one that twins were verified for)"
            )
    for element in hand.element:
        tree.element.append(copy.deepcopy(element))
    joint = add_joint(tree.element, f"{root_link}_mount", "fixed", mount_link, root_link)
    set_origin(joint, root_to_mount)


def generated_hand(gripper: ParallelGripper, mass_kg: float) -> UrdfTree:
    """Return a parallel gripper's boxes as a URDF of a palm and two prismatic fingers; the palm frame is the grasp frame.

    The gripper's file has no masses, so ``mass_kg`` is distributed by the boxes' volumes.
    """
    name = gripper.name
    robot = new_element("robot", name=name)
    palm = [box.placed() for box in gripper.palm_boxes]
    fingers = {side: [box.placed(0.0, sign) for box in gripper.finger_boxes] for side, sign in SIDES}
    density = mass_kg / sum(_volume(boxes) for boxes in (palm, *fingers.values()))
    add_box_link(robot, palm_link(name), palm, density)
    for side, sign in SIDES:
        add_box_link(robot, finger_link(name, side), fingers[side], density)
        joint = add_joint(robot, finger_joint(name, side), "prismatic", palm_link(name), finger_link(name, side))
        set_origin(joint, np.eye(4))
        add(joint, "axis", xyz=f"{sign} 0 0")
        half_m = repr(gripper.opening_m / 2)
        add(joint, "limit", lower="0", upper=half_m, velocity="0.1", effort=repr(gripper.force_n))
    return UrdfTree(f"hand generated of gripper {name}", robot)


def palm_link(gripper: str) -> str:
    """Return the name of a generated hand's palm link."""
    return f"{gripper}_palm"


def finger_link(gripper: str, side: str) -> str:
    """Return the name of a generated hand's finger link on the ``plus`` or ``minus`` side of X."""
    return f"{gripper}_finger_{side}"


def finger_joint(gripper: str, side: str) -> str:
    """Return the name of the joint that moves that finger."""
    return f"{finger_link(gripper, side)}_joint"


def _volume(boxes: list[PlacedBox]) -> float:
    return float(sum(8 * half.prod() for _, half in boxes))


def add_joint(robot: etree._Element, name: str, kind: str, parent: str, child: str) -> etree._Element:
    """Add a joint between two links to a URDF, and return it."""
    joint = add(robot, "joint", name=name, type=kind)
    add(joint, "parent", link=parent)
    add(joint, "child", link=child)
    return joint


def add_box_link(robot: etree._Element, name: str, boxes: list[PlacedBox], density_kg_m3: float) -> None:
    """Add a link of boxes of uniform density to a URDF, with visual, collision and inertial elements."""
    link = add(robot, "link", name=name)
    for box_to_link, half_m in boxes:
        for tag in ("visual", "collision"):
            shape = add(link, tag)
            set_origin(shape, box_to_link)
            size = " ".join(repr(float(2 * half)) for half in half_m)
            add(add(shape, "geometry"), "box", size=size)
            if tag == "visual":
                material = add(shape, "material", name=f"{name}_grey")
                add(material, "color", rgba=_GREY)
    add_inertial(link, boxes, density_kg_m3)


def add_inertial(link: etree._Element, boxes: list[PlacedBox], density_kg_m3: float) -> None:
    """Write the mass properties of boxes of uniform density (parallel axis theorem); overlapping volume counts twice."""
    masses = np.array([density_kg_m3 * 8 * half.prod() for _, half in boxes])
    centers = np.array([pose[:3, 3] for pose, _ in boxes])
    center = masses @ centers / masses.sum()
    tensor = np.zeros((3, 3))
    for mass, (pose, half) in zip(masses, boxes, strict=True):
        own = np.diag(half @ half - half**2) * mass / 3
        offset = transform_points(inverse(transform(translation=center)), pose[None, :3, 3])[0]
        tensor += pose[:3, :3] @ own @ pose[:3, :3].T + mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    inertial = add(link, "inertial")
    set_origin(inertial, transform(translation=center))
    add(inertial, "mass", value=repr(float(masses.sum())))
    keys = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    add(inertial, "inertia", **{key: repr(float(tensor[at])) for key, at in keys.items()})


def configure_arm_joints(
    tree: UrdfTree, arm_joints: tuple[str, ...], tip_link: str, limits_rad: dict[str, tuple[float, float]]
) -> None:
    """Check that ``arm_joints`` form the chain from the root to the tip, and narrow their limits in place.

    A continuous joint becomes revolute with the limits in ``limits_rad``. Raises ConfigError naming valid values.
    """
    unknown = sorted(set(limits_rad) - set(arm_joints))
    if unknown:
        raise ConfigError(
            f"{tree.name}: limits_rad names {', '.join(unknown)}; the arm's joints are {', '.join(arm_joints)}"
        )
    for name in arm_joints:
        _settle_arm_joint(tree, name, limits_rad.get(name))
    chain = tuple(name for name in _way_to(tree, tip_link) if tree.joints[name].get("type") != "fixed")
    if chain != arm_joints:
        raise ConfigError(
            f"{tree.name}: the movable joints on the way to {tip_link} are {', '.join(chain) or 'none'}; "
            f"arm_joints names {', '.join(arm_joints)}"
        )


def _way_to(tree: UrdfTree, link: str) -> list[str]:
    tree.link(link)
    holders = {child_of(joint): name for name, joint in tree.joints.items()}
    way: list[str] = []
    while link in holders:
        way.insert(0, holders[link])
        link = parent_of(tree.joints[way[0]])
    return way


def _settle_arm_joint(tree: UrdfTree, name: str, given: tuple[float, float] | None) -> None:
    joint = tree.joint(name)
    kind, limit = joint.get("type"), joint.find("limit")
    if kind not in ("revolute", "continuous"):
        raise ConfigError(f"{tree.name}: arm joint {name} is {kind}; an arm's joints are revolute")
    if joint.find("mimic") is not None:
        raise ConfigError(f"{tree.name}: arm joint {name} mimics another; name joints that move independently")
    if limit is None or float(limit.get("velocity", "0")) <= 0:
        raise ConfigError(f"{tree.name}: arm joint {name} has no velocity limit; give it <limit velocity>")
    if kind == "continuous":
        if given is None:
            raise ConfigError(f"{tree.name}: arm joint {name} is continuous; give its range under limits_rad")
        joint.set("type", "revolute")
    elif limit.get("lower") is None or limit.get("upper") is None:
        raise ConfigError(f"{tree.name}: arm joint {name} lacks lower or upper of its <limit>; give both")
    elif given is not None and not (float(limit.get("lower")) <= given[0] and given[1] <= float(limit.get("upper"))):
        raise ConfigError(
            f"{tree.name}: limits_rad of {name} exceed the URDF's {limit.get('lower')} to {limit.get('upper')}; narrow them"
        )
    if given is not None:
        limit.set("lower", repr(float(given[0])))
        limit.set("upper", repr(float(given[1])))
    if float(limit.get("lower")) >= float(limit.get("upper")):
        raise ConfigError(f"{tree.name}: arm joint {name} has no range; give a lower limit below the upper one")


def joint_limits(tree: UrdfTree, names: tuple[str, ...], key: str) -> np.ndarray:
    """Return one attribute of each joint's ``<limit>``, ``(n,)``: ``lower``, ``upper`` or ``velocity``."""
    return np.array([float(tree.joint(name).find("limit").get(key)) for name in names])


def configure_finger_joints(tree: UrdfTree, names: tuple[str, str], half_opening_m: float) -> None:
    """Check the joints of the two fingers, remove their ``<mimic>``, and set their range from 0 to half of the opening.

    Raises ConfigError if a joint is not prismatic, if its range is too small, or if it mimics anything other than the
    opposite finger one to one.
    """
    if len(set(names)) != 2:
        raise ConfigError(f"{tree.name}: finger_joints names {names[0]} twice; name two joints")
    for name, other in (names, names[::-1]):
        joint = tree.joint(name)
        mimic, limit = joint.find("mimic"), joint.find("limit")
        if joint.get("type") != "prismatic":
            raise ConfigError(
                f"{tree.name}: finger joint {name} is {joint.get('type')}; a parallel hand's are prismatic. "
                "Mount a hand of the kind 'generated' instead"
            )
        if mimic is not None:
            ratio, offset = float(mimic.get("multiplier", "1")), float(mimic.get("offset", "0"))
            if mimic.get("joint") != other or (ratio, offset) != (1.0, 0.0):
                raise ConfigError(f"{tree.name}: finger joint {name} must follow {other} one to one, or nothing")
            joint.remove(mimic)
        lower, upper = (float(limit.get(key, "0")) for key in ("lower", "upper")) if limit is not None else (0.0, 0.0)
        if lower > REACH_TOLERANCE_M or upper < half_opening_m - REACH_TOLERANCE_M:
            raise ConfigError(
                f"{tree.name}: finger joint {name} runs from {lower:g} to {upper:g} m; "
                f"the gripper needs 0 (closed) to {half_opening_m:g} m"
            )
        limit.set("lower", "0")
        limit.set("upper", repr(half_opening_m))


def fix_other_joints(tree: UrdfTree, moving: tuple[str, ...], fixed_joints: dict[str, float]) -> None:
    """Fix every movable joint except ``moving`` at its position in ``fixed_joints`` (rad or m).

    Raises ConfigError if ``fixed_joints`` does not name exactly these joints.
    """
    others = [name for name, joint in tree.joints.items() if joint.get("type") != "fixed" and name not in moving]
    wrong = sorted(set(fixed_joints) ^ set(others))
    if wrong:
        raise ConfigError(
            f"{tree.name}: fixed_joints must give a position for {', '.join(others) or 'no joint'}: "
            f"those that move and are of neither arm nor hand; {', '.join(wrong)} differ(s)"
        )
    for name in others:
        _fix(tree.joints[name], fixed_joints[name])


def _fix(joint: etree._Element, position: float) -> None:
    """Convert a joint to a fixed joint at a position (rad or m)."""
    axis = joint.find("axis")
    direction = np.array([1.0, 0, 0]) if axis is None else values_of(axis, "xyz")
    direction = direction / np.linalg.norm(direction)
    if joint.get("type") == "prismatic":
        moved = transform(translation=position * direction)
    else:
        moved = transform(Rotation.from_rotvec(position * direction).as_matrix())
    set_origin(joint, origin_of(joint) @ moved)
    for tag in ("limit", "mimic", "axis"):
        for element in joint.findall(tag):
            joint.remove(element)
    joint.set("type", "fixed")
