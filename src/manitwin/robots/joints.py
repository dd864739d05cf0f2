"""The joints of a robot's URDF made what planner and simulation take: n revolute, two prismatic, the rest fixed."""

from __future__ import annotations

import numpy as np
from lxml import etree  # type: ignore[import-untyped]
from scipy.spatial.transform import Rotation

from manitwin.errors import UsageError
from manitwin.geometry.poses import transform
from manitwin.robots.urdf_tree import UrdfTree, child_of, parent_of

REACH_TOLERANCE_M = 1e-4


def settle_arm_joints(
    tree: UrdfTree, arm_joints: tuple[str, ...], tip_link: str, limits_rad: dict[str, tuple[float, float]]
) -> None:
    """Check that the arm's joints are the way from the root to the tip, and narrow their limits in place.

    A continuous joint becomes a revolute one of the limits that are given. Raises UsageError naming what would be valid.
    """
    unknown = sorted(set(limits_rad) - set(arm_joints))
    if unknown:
        raise UsageError(
            f"{tree.name}: limits_rad names {', '.join(unknown)}; the arm's joints are {', '.join(arm_joints)}"
        )
    for name in arm_joints:
        _settle_arm_joint(tree, name, limits_rad.get(name))
    chain = tuple(name for name in _way_to(tree, tip_link) if tree.joints[name].get("type") != "fixed")
    if chain != arm_joints:
        raise UsageError(
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
        raise UsageError(f"{tree.name}: arm joint {name} is {kind}; an arm's joints are revolute")
    if joint.find("mimic") is not None:
        raise UsageError(f"{tree.name}: arm joint {name} mimics another; name joints that move on their own")
    if limit is None or float(limit.get("velocity", "0")) <= 0:
        raise UsageError(f"{tree.name}: arm joint {name} has no velocity limit; give it <limit velocity>")
    if kind == "continuous":
        if given is None:
            raise UsageError(f"{tree.name}: arm joint {name} is continuous; give its range under limits_rad")
        joint.set("type", "revolute")
    elif limit.get("lower") is None or limit.get("upper") is None:
        raise UsageError(f"{tree.name}: arm joint {name} lacks lower or upper of its <limit>; give both")
    elif given is not None and not (float(limit.get("lower")) <= given[0] and given[1] <= float(limit.get("upper"))):
        raise UsageError(
            f"{tree.name}: limits_rad of {name} exceed the URDF's {limit.get('lower')} to {limit.get('upper')}; narrow them"
        )
    if given is not None:
        limit.set("lower", repr(float(given[0])))
        limit.set("upper", repr(float(given[1])))
    if float(limit.get("lower")) >= float(limit.get("upper")):
        raise UsageError(f"{tree.name}: arm joint {name} has no range; give a lower limit below the upper one")


def limits_of(tree: UrdfTree, names: tuple[str, ...], key: str) -> np.ndarray:
    """Return one value of each joint's ``<limit>`` ``(n,)``: ``lower``, ``upper`` or ``velocity``."""
    return np.array([float(tree.joint(name).find("limit").get(key)) for name in names])


def settle_finger_joints(tree: UrdfTree, names: tuple[str, str], half_opening_m: float) -> None:
    """Check the two fingers' joints, free them of mimicry, and set their range to 0 to half of the opening.

    Raises UsageError where one is not prismatic, does not reach that far, or follows other than its twin one to one.
    """
    if len(set(names)) != 2:
        raise UsageError(f"{tree.name}: finger_joints names {names[0]} twice; name two joints")
    for name, other in (names, names[::-1]):
        joint = tree.joint(name)
        mimic, limit = joint.find("mimic"), joint.find("limit")
        if joint.get("type") != "prismatic":
            raise UsageError(
                f"{tree.name}: finger joint {name} is {joint.get('type')}; a parallel hand's are prismatic. "
                "Mount a hand of the kind 'generated' instead"
            )
        if mimic is not None:
            ratio, offset = float(mimic.get("multiplier", "1")), float(mimic.get("offset", "0"))
            if mimic.get("joint") != other or (ratio, offset) != (1.0, 0.0):
                raise UsageError(f"{tree.name}: finger joint {name} must follow {other} one to one, or nothing")
            joint.remove(mimic)
        lower, upper = (float(limit.get(key, "0")) for key in ("lower", "upper")) if limit is not None else (0.0, 0.0)
        if lower > REACH_TOLERANCE_M or upper < half_opening_m - REACH_TOLERANCE_M:
            raise UsageError(
                f"{tree.name}: finger joint {name} runs from {lower:g} to {upper:g} m; "
                f"the gripper wants 0 (closed) to {half_opening_m:g} m"
            )
        limit.set("lower", "0")
        limit.set("upper", repr(half_opening_m))


def fix_other_joints(tree: UrdfTree, moving: tuple[str, ...], fixed_joints: dict[str, float]) -> None:
    """Fix every movable joint but ``moving`` where ``fixed_joints`` says (rad, or m); raises UsageError for one it lacks."""
    others = [name for name, joint in tree.joints.items() if joint.get("type") != "fixed" and name not in moving]
    wrong = sorted(set(fixed_joints) ^ set(others))
    if wrong:
        raise UsageError(
            f"{tree.name}: fixed_joints must give a position for {', '.join(others) or 'no joint'}: "
            f"those that move and are of neither arm nor hand; {', '.join(wrong)} differ(s)"
        )
    for name in others:
        _fix(tree.joints[name], fixed_joints[name])


def _fix(joint: etree._Element, position: float) -> None:
    """Make a joint fixed at a position."""
    axis = joint.find("axis")
    direction = np.array([1.0, 0, 0] if axis is None else [float(word) for word in axis.get("xyz").split()])
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


def origin_of(element: etree._Element) -> np.ndarray:
    """Return an element's ``<origin>`` as a pose ``(4, 4)``; identity where it has none (URDF specification)."""
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    xyz, rpy = ([float(word) for word in origin.get(key, "0 0 0").split()] for key in ("xyz", "rpy"))
    return transform(Rotation.from_euler("xyz", rpy).as_matrix(), np.array(xyz))


def set_origin(element: etree._Element, pose: np.ndarray) -> None:
    """Write a pose as an element's ``<origin>``: fixed-axis roll, pitch, yaw (URDF specification)."""
    origin = element.find("origin")
    if origin is None:
        origin = etree.SubElement(element, "origin")
    rpy = Rotation.from_matrix(pose[:3, :3]).as_euler("xyz")
    origin.set("xyz", " ".join(repr(float(value)) for value in pose[:3, 3]))
    origin.set("rpy", " ".join(repr(float(value)) for value in rpy))
