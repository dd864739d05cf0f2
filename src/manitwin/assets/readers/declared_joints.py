"""What URDF and SDF say of a joint in the same words: its kind, the direction of its axis, and why a twin cannot have it."""

from __future__ import annotations

import math

import numpy as np

from manitwin.geometry.articulation import JointKind

JOINT_KINDS: dict[str, JointKind] = {"revolute": "revolute", "continuous": "continuous", "prismatic": "prismatic"}
"""The joints that twins have, by their ``type``."""
Limits = tuple[float | None, float | None] | None
"""The lowest and the highest position, rad or m, (None, None) where there are none; None where no position lies between them."""
_LONGEST_NAME = 60
_SHORTEST_AXIS = 1e-9


def unit_direction(text: str) -> np.ndarray | None:
    """Return the three numbers of an ``xyz`` as a vector ``(3,)`` of length one; None where they have no direction."""
    try:
        axis = np.array([float(word) for word in text.replace(",", " ").split()])
    except ValueError:
        return None
    length = float(np.linalg.norm(axis)) if axis.shape == (3,) else 0.0
    return axis / length if math.isfinite(length) and length > _SHORTEST_AXIS else None


def why_no_joint_of_a_twin(name: str, written: str, *, mimics: bool) -> str:
    """Return why twins have no joint of the type ``written``, or that ``mimics`` another one; empty where they have."""
    if written not in JOINT_KINDS:
        return f"{name[:_LONGEST_NAME]!r} is {written}, which twins do not have"
    if mimics:
        return f"{name[:_LONGEST_NAME]!r} copies another one (mimic), which twins do not have"
    return ""


def why_it_cannot_move(name: str, axis: np.ndarray | None, limits: Limits) -> str:
    """Return why a joint of this axis and these limits cannot move; empty where it can."""
    if axis is not None and limits is not None:
        return ""
    what = "axis has no direction" if axis is None else "limits leave it no way"
    return f"{name[:_LONGEST_NAME]!r} cannot move: its {what}"
