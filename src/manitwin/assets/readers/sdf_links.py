"""Selection of the links of an SDF model that are read, and of their joints that twins support."""

from __future__ import annotations

import math

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.articulation import BodyNode, LinkTree, build_link_tree
from manitwin.assets.asset_files import AssetFiles
from manitwin.assets.joints import Joints
from manitwin.assets.readers.declared_joints import (
    JOINT_KINDS,
    Limits,
    immovable_reason,
    unit_direction,
    unsupported_joint_reason,
)
from manitwin.assets.readers.sdf_shapes import ModelFrames, pose_of
from manitwin.formats.xml_file import text_of
from manitwin.geometry.articulation import ArticulatedJoint

_COUPLES = "gearbox"  # a gearbox couples two joints and holds no link
_UNLIMITED = 1e15  # SDFormat's default is 1e16
_AXES_OF_THE_MODEL = (1, 4)  # up to this version, axes were written in the model's frame

Links = dict[str, etree._Element]
Ends = tuple[str, str]
"""The links of a joint, parent first."""


def chosen_links(
    model: etree._Element, frames: ModelFrames, files: AssetFiles, joints: Joints, version: str | None
) -> tuple[tuple[etree._Element, ...], LinkTree | None]:
    """Return the links of the first object with a shape, root of the tree first, and its joint tree for ``joints="keep"``.

    With "part", links on fixed joints form one object, and links behind movable joints are others. With "lock" and "keep", all
    joints connect an object, in the pose of the file, with all joints at position 0. ``version`` is the SDFormat version of the
    document.
    """
    links: Links = {link.get("name"): link for link in model.findall("link")}
    held = [(joint, ends) for joint in model.findall("joint") if (ends := _ends(joint, frames)) is not None]
    group = {name: {name} for name in links}
    for joint, ends in held:
        if _constrains(joint, joints) and all(end in links for end in ends) and group[ends[0]] is not group[ends[1]]:
            small, large = sorted((group[end] for end in ends), key=len)
            large |= small
            group.update(dict.fromkeys(small, large))
    moves = {ends[1]: joint for joint, ends in held if ends[1] in links and joint.get("type") != "fixed"}
    chosen: set[str] | None = None
    left_out = []
    for name, link in links.items():
        shaped = link.find("visual") is not None or link.find("collision") is not None
        if chosen is None and shaped:
            chosen = group[name]
        elif chosen is not None and shaped and name not in chosen:
            how = f"moves by joint {_joint_text(moves[name])}" if name in moves else "is joined to nothing fixed"
            left_out.append(f"link {name!r} {how}")
    files.remark_left_out(left_out, "links")
    chosen = chosen or group[next(iter(links))]
    if joints == "lock":
        files.remark_locked([_joint_text(joint) for name, joint in moves.items() if name in chosen])
    kept = tuple(link for name, link in links.items() if name in chosen)
    within = [
        (joint, ends) for joint, ends in held if all(end in chosen for end in ends) and _constrains(joint, joints)
    ]
    if joints != "keep" or all(joint.get("type") == "fixed" for joint, _ in within):
        return kept, None
    order, nodes = _tree([str(link.get("name")) for link in kept], links, within, files, frames, version)
    found = build_link_tree(nodes)
    for remark in found.remarks:
        files.remark(remark)
    return tuple(links[name] for name in order), found if found.joints else None


def _tree(
    names: list[str],
    links: Links,
    held: list[tuple[etree._Element, Ends]],
    files: AssetFiles,
    frames: ModelFrames,
    version: str | None,
) -> tuple[list[str], list[BodyNode]]:
    """Return the link names, parents first, and a node for each link.

    A joint that would attach a link a second time closes a loop, and is left out with a remark. A joint traversed from its
    child to its parent gets the opposite axis.
    """
    children = {ends[1] for _, ends in held}
    root = next((name for name in names if name not in children), names[0])
    order, left = [root], list(held)
    nodes = [BodyNode(root, None, links[root].find("visual") is not None)]
    for name in order:  # grows by the links attached to it
        for joint, ends in [each for each in left if name in each[1]]:
            left.remove((joint, ends))
            other = ends[1] if name == ends[0] else ends[0]
            if other in order:
                files.remark(f"joint {_joint_text(joint)} closes a loop and was left out")
                continue
            kept, cause = _kept(joint, ends, frames, version, backward=name == ends[1])
            nodes.append(BodyNode(other, order.index(name), links[other].find("visual") is not None, kept, cause))
            order.append(other)
    return order, nodes


def _kept(
    joint: etree._Element, ends: Ends, frames: ModelFrames, version: str | None, *, backward: bool
) -> tuple[ArticulatedJoint | None, str]:
    """Return a joint in the model's axes and "", or None and the reason; the reason is empty for a fixed joint."""
    written, name = joint.get("type") or "", str(joint.get("name"))
    if written == "fixed":
        return None, ""
    if cause := unsupported_joint_reason(name, written, mimics=joint.find("axis/mimic") is not None):
        return None, cause
    kind, placed = JOINT_KINDS[written], _pose(joint, ends, frames)
    axis, limits = _axis(joint, placed, frames, version), _limits(joint)
    if axis is None or limits is None:
        return None, immovable_reason(name, axis, limits)
    lower, upper = limits if kind != "continuous" else (None, None)
    if lower is not None and upper is not None and not lower <= 0 <= upper:
        return None, f"{name[:60]!r} stands outside of its limits"
    kind = "continuous" if kind == "revolute" and lower is None else kind
    return (
        ArticulatedJoint(
            name=name,
            kind=kind,
            parent=0,
            child=0,
            origin_m=placed[:3, 3],
            axis=-axis if backward else axis,
            lower=lower,
            upper=upper,
            damping=max(0.0, _number(joint, "axis/dynamics/damping") or 0.0),
            friction=max(0.0, _number(joint, "axis/dynamics/friction") or 0.0),
            effort=_positive(joint, "axis/limit/effort"),
            velocity=_positive(joint, "axis/limit/velocity"),
        ),
        "",
    )


def _pose(joint: etree._Element, ends: Ends, frames: ModelFrames) -> np.ndarray:
    """Return a joint's pose in the model's frame ``(4, 4)``; by default, poses are relative to the child."""
    pose = joint.find("pose")
    base = (None if pose is None else pose.get("relative_to")) or (joint.findtext("child") or "").strip() or ends[1]
    return frames.to_model(base) @ pose_of(joint, f"joint {joint.get('name')!r}")


def _axis(joint: etree._Element, placed: np.ndarray, frames: ModelFrames, version: str | None) -> np.ndarray | None:
    """Return a joint's unit axis in the model's frame; None if it has no direction.

    It is written in the joint's frame by default, and up to SDFormat 1.4 in that of the model.
    """
    element = joint.find("axis/xyz")
    axis = unit_direction(text_of(joint, "axis/xyz") or "0 0 1")
    if axis is None:
        return None
    frame = None if element is None else element.get("expressed_in")
    of_model = (text_of(joint, "axis/use_parent_model_frame") or "").lower() in ("true", "1") or _is_old(version)
    turn = np.eye(3) if frame is None and of_model else (placed if frame is None else frames.to_model(frame))[:3, :3]
    return np.asarray(turn @ axis)


def _is_old(version: str | None) -> bool:
    try:
        return tuple(int(number) for number in (version or "").split(".")) <= _AXES_OF_THE_MODEL
    except ValueError:
        return False


def _limits(joint: etree._Element) -> Limits:
    lower, upper = (_number(joint, f"axis/limit/{key}") for key in ("lower", "upper"))
    if lower is None or upper is None or max(-lower, upper) >= _UNLIMITED:
        return None, None
    return (lower, upper) if lower < upper else None


def _number(joint: etree._Element, path: str) -> float | None:
    try:
        value = float(text_of(joint, path) or "nan")
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _positive(joint: etree._Element, path: str) -> float | None:
    value = _number(joint, path)
    return value if value is not None and 0 < value < _UNLIMITED else None


def _ends(joint: etree._Element, frames: ModelFrames) -> Ends | None:
    parent, child = (frames.link_of((joint.findtext(tag) or "").strip()) for tag in ("parent", "child"))
    return None if not child else (parent, child)


def _constrains(joint: etree._Element, joints: Joints) -> bool:
    kind = joint.get("type") or ""
    return kind == "fixed" or (joints != "part" and kind != _COUPLES)


def _joint_text(joint: etree._Element) -> str:
    return f"{joint.get('name')} ({joint.get('type') or ''})"
