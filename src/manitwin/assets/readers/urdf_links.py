"""Selection of the links of a URDF that are read, their poses, and the joints that twins support."""

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
from manitwin.geometry.articulation import ArticulatedJoint
from manitwin.robots.urdf import UrdfTree, child_of, origin_of, parent_of

Placed = tuple[etree._Element, np.ndarray]
"""A link element, and its pose ``(4, 4)`` in the frame of the first link."""
_LET_GO = ("floating", "planar")
_AXIS = np.array([1.0, 0, 0])
"""The default axis of the URDF specification."""


def chosen_links(tree: UrdfTree, files: AssetFiles, joints: Joints) -> tuple[tuple[Placed, ...], LinkTree | None]:
    """Return the links of the first object with a shape, with their poses, and its joint tree for ``joints="keep"``.

    With "part", links on fixed joints form one object, and links behind movable joints are others. With "lock", all links are
    one rigid object at joint positions 0. With "keep", each joint is at the position within its limits closest to 0. Links with
    a collision shape or mass have priority over purely visual ones, such as footprint markers.
    """
    links, heads = tree.links, tree.roots()
    held = {child_of(joint): joint for joint in tree.joints.values()}
    children: dict[str, list[str]] = {name: [] for name in links}
    for child, joint in held.items():
        children[parent_of(joint)].append(child)
    groups: list[list[tuple[str, np.ndarray]]] = []
    for head in heads:  # grows by the links behind movable joints
        group = [(head, np.eye(4))]
        for name, pose in group:
            for child in children[name]:
                kind = held[child].get("type")
                if kind == "fixed" or (joints != "part" and kind not in _LET_GO):
                    group.append((child, pose @ _child_to_parent(held[child], joints)))
                else:
                    heads.append(child)
        groups.append(group)
    shaped = [group for group in groups if any(_has_shape(links[name]) for name, _ in group)]
    bodies = [group for group in shaped if any(_is_body(links[name]) for name, _ in group)]
    chosen = (bodies or shaped or groups)[0]
    left_out = []
    for group in [group for group in shaped if group is not chosen]:
        holder = held.get(group[0][0])
        how = "holds others by joints" if any(children[name] for name, _ in group) else "is joined to nothing"
        if holder is not None:
            how = f"moves by joint {holder.get('name')} ({holder.get('type')})"
        left_out.append(f"link {group[0][0]!r} {how}")
    files.remark_left_out(left_out, "links")
    placed = tuple((links[name], pose) for name, pose in chosen)
    inside = {name for name, _ in chosen}
    moving = [held[name] for name, _ in chosen[1:] if held[name].get("type") != "fixed"]
    if joints == "lock":
        files.remark_locked([joint.get("name") for joint in moving if parent_of(joint) in inside])
    if joints != "keep" or not moving:
        return placed, None
    found = build_link_tree(_nodes(chosen, links, held))
    for remark in found.remarks:
        files.remark(remark)
    return placed, found if found.joints else None


def _nodes(
    chosen: list[tuple[str, np.ndarray]], links: dict[str, etree._Element], held: dict[str, etree._Element]
) -> list[BodyNode]:
    place_of = {name: place for place, (name, _) in enumerate(chosen)}
    seen = {name: links[name].find("visual") is not None for name in place_of}
    nodes = [BodyNode(chosen[0][0], None, seen[chosen[0][0]])]
    for name, pose in chosen[1:]:
        joint, cause = _kept(held[name], pose)
        nodes.append(BodyNode(name, place_of[parent_of(held[name])], seen[name], joint, cause))
    return nodes


def _kept(joint: etree._Element, child_to_asset: np.ndarray) -> tuple[ArticulatedJoint | None, str]:
    """Return a joint in the asset's axes and "", or None and the reason; the reason is empty for a fixed joint."""
    written, name = joint.get("type") or "", str(joint.get("name"))
    if written == "fixed":
        return None, ""
    if cause := unsupported_joint_reason(name, written, mimics=joint.find("mimic") is not None):
        return None, cause
    kind, axis, limits = JOINT_KINDS[written], _axis(joint), _limits(joint)
    if axis is None or limits is None:
        return None, immovable_reason(name, axis, limits)
    lower, upper = limits
    if kind == "revolute" and lower is None:
        kind = "continuous"
    return (
        ArticulatedJoint(
            name=name,
            kind=kind,
            parent=0,
            child=0,
            origin_m=child_to_asset[:3, 3],
            axis=child_to_asset[:3, :3] @ axis,
            lower=None if kind == "continuous" else lower,
            upper=None if kind == "continuous" else upper,
            stands_at=_position_near_zero(joint),
            damping=max(0.0, _number(joint.find("dynamics"), "damping") or 0.0),
            friction=max(0.0, _number(joint.find("dynamics"), "friction") or 0.0),
            effort=_positive(joint.find("limit"), "effort"),
            velocity=_positive(joint.find("limit"), "velocity"),
        ),
        "",
    )


def _child_to_parent(joint: etree._Element, joints: Joints) -> np.ndarray:
    """Return the pose ``(4, 4)`` of a joint's child in its parent."""
    origin = origin_of(joint)
    kind, axis = JOINT_KINDS.get(joint.get("type") or ""), _axis(joint)
    position = _position_near_zero(joint) if joints == "keep" else 0.0
    if position == 0.0 or kind is None or axis is None:
        return origin
    moved = ArticulatedJoint("", kind, 0, 0, np.zeros(3), axis).motion(position)
    return origin @ moved


def _position_near_zero(joint: etree._Element) -> float:
    """Return the position within a joint's limits that is closest to 0."""
    limits = _limits(joint)
    if joint.get("type") == "continuous" or limits is None or limits[0] is None or limits[1] is None:
        return 0.0
    return float(np.clip(0.0, limits[0], limits[1]))


def _limits(joint: etree._Element) -> Limits:
    limit = joint.find("limit")
    if joint.get("type") == "continuous" or limit is None:
        return None, None
    lower, upper = (_number(limit, key, 0.0) for key in ("lower", "upper"))
    if lower is None or upper is None or not lower < upper:
        return None
    return lower, upper


def _axis(joint: etree._Element) -> np.ndarray | None:
    """Return a joint's unit axis; None if it has no direction."""
    element = joint.find("axis")
    if element is None:
        return _AXIS
    return unit_direction(element.get("xyz") or "")


def _number(element: etree._Element | None, key: str, default: float | None = None) -> float | None:
    try:
        value = float(element.get(key)) if element is not None and element.get(key) else default
    except ValueError:
        return None
    return value if value is not None and math.isfinite(value) else None


def _positive(element: etree._Element | None, key: str) -> float | None:
    value = _number(element, key)
    return value if value is not None and value > 0 else None


def _has_shape(link: etree._Element) -> bool:
    return link.find("visual") is not None or link.find("collision") is not None


def _is_body(link: etree._Element) -> bool:
    return link.find("collision") is not None or link.find("inertial") is not None
