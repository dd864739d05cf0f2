"""Joint properties that URDF and SDF declare alike: kind, axis direction, limits, and reasons why a joint is not supported."""

from __future__ import annotations

import math

import numpy as np

from manitwin.geometry.articulation import JointKind

JOINT_KINDS: dict[str, JointKind] = {"revolute": "revolute", "continuous": "continuous", "prismatic": "prismatic"}
"""Joint kinds that twins support, by their ``type`` attribute."""
Limits = tuple[float | None, float | None] | None
"""Lowest and highest position in rad or m, (None, None) for an unlimited joint; None for an empty range."""
_LONGEST_NAME = 60
_SHORTEST_AXIS = 1e-9


def unit_direction(text: str) -> np.ndarray | None:
    """Return an ``xyz`` attribute as a unit vector ``(3,)``; None if it is not three numbers or has no direction."""
    try:
        axis = np.array([float(word) for word in text.replace(",", " ").split()])
    except ValueError:
        return None
    length = float(np.linalg.norm(axis)) if axis.shape == (3,) else 0.0
    return axis / length if math.isfinite(length) and length > _SHORTEST_AXIS else None


def unsupported_joint_reason(name: str, written: str, *, mimics: bool) -> str:
    """Return why twins do not support a joint of type ``written``, or one that ``mimics`` another; empty if they do."""
    if written not in JOINT_KINDS:
        return f"{name[:_LONGEST_NAME]!r} is {written}, which twins do not have"
    if mimics:
        return f"{name[:_LONGEST_NAME]!r} copies another one (mimic), which twins do not have"
    return ""


def immovable_reason(name: str, axis: np.ndarray | None, limits: Limits) -> str:
    """Return why a joint with this axis and these limits cannot move; empty if it can."""
    if axis is not None and limits is not None:
        return ""
    what = "axis has no direction" if axis is None else "limits leave it no way"
    return f"{name[:_LONGEST_NAME]!r} cannot move: its {what}"
