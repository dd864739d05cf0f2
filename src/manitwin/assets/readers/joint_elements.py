"""Declared joints of URDF and SDF elements and of a compiled MJCF, without validation, which is left to the audit."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.joints import DeclaredJoint
from manitwin.formats.xml_file import text_of
from manitwin.robots.urdf import UrdfTree, child_of, parent_of

_UNLIMITED = 1e15
"""Values from here on mean unlimited; SDFormat's default is 1e16."""
_MJCF_KINDS = {
    int(mujoco.mjtJoint.mjJNT_FREE): "free",
    int(mujoco.mjtJoint.mjJNT_BALL): "ball",
    int(mujoco.mjtJoint.mjJNT_SLIDE): "slide",
    int(mujoco.mjtJoint.mjJNT_HINGE): "hinge",
}


def urdf_joints(tree: UrdfTree) -> tuple[DeclaredJoint, ...]:
    """Return the joints of a URDF."""
    return tuple(_urdf_joint(name, joint) for name, joint in tree.joints.items())


def _urdf_joint(name: str, joint: etree._Element) -> DeclaredJoint:
    axis, limit, mimic = joint.find("axis"), joint.find("limit"), joint.find("mimic")
    lower, upper = (None, None) if limit is None else (_number(limit.get(key, "0")) for key in ("lower", "upper"))
    follows = None if mimic is None else mimic.get("joint")
    written = None if axis is None else _three(axis.get("xyz"))
    kind = joint.get("type") or ""
    return DeclaredJoint(name, kind, parent_of(joint), child_of(joint), written, lower, upper, follows)


def sdf_joints(model: etree._Element) -> tuple[DeclaredJoint, ...]:
    """Return the joints of an SDF model."""
    return tuple(_sdf_joint(joint) for joint in model.findall("joint"))


def _sdf_joint(joint: etree._Element) -> DeclaredJoint:
    axis = text_of(joint, "axis/xyz")
    lower, upper = (_limit(text_of(joint, f"axis/limit/{key}")) for key in ("lower", "upper"))
    ends = [(joint.findtext(tag) or "").strip() for tag in ("parent", "child")]
    written = None if axis is None else _three(axis)
    return DeclaredJoint(joint.get("name") or "", joint.get("type") or "", ends[0], ends[1], written, lower, upper)


def mjcf_joints(model: Any) -> tuple[DeclaredJoint, ...]:
    """Return the joints of a compiled MJCF, with axes normalized and limits in radians by MuJoCo."""
    joints = []
    for index in range(model.njnt):
        body = int(model.jnt_bodyid[index])
        lower, upper = (None, None)
        if model.jnt_limited[index]:
            lower, upper = (float(value) for value in model.jnt_range[index])
        joints.append(
            DeclaredJoint(
                model.joint(index).name or f"joint_{index:02d}",
                _MJCF_KINDS[int(model.jnt_type[index])],
                model.body(int(model.body_parentid[body])).name,
                model.body(body).name,
                np.array(model.jnt_axis[index]),
                lower,
                upper,
            )
        )
    return tuple(joints)


def _limit(text: str | None) -> float | None:
    value = None if text is None else _number(text)
    return math.copysign(math.inf, value) if value is not None and abs(value) >= _UNLIMITED else value


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _three(text: str | None) -> np.ndarray:
    values = [_number(word) for word in (text or "").replace(",", " ").split()]
    return np.array(values if len(values) == 3 else [math.nan] * 3)
