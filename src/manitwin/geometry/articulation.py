"""Kinematic trees of rigid links with one-degree-of-freedom joints; the first link is the root."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import RigidBody

JointKind = Literal["revolute", "continuous", "prismatic"]


def axis_motion(origin_m: np.ndarray, axis: np.ndarray, way: float, *, slides: bool) -> np.ndarray:
    """Return the motion ``(4, 4)`` by ``way``: metres along a unit axis, or radians about it through ``origin_m`` (right-hand
    rule).
    """
    if slides:
        return transform(None, way * axis)
    rotation = Rotation.from_rotvec(way * axis).as_matrix()
    return transform(rotation, origin_m - rotation @ origin_m)


@dataclass(frozen=True)
class ArticulatedJoint:
    """A joint between the links ``parent`` and ``child``, given by their indices; parents come first.

    ``origin_m (3,)`` lies on the joint axis and ``axis (3,)`` has length one, both in one frame common to all links, in the
    configuration in which the joint is at ``stands_at``. Positions and the limits ``lower`` and ``upper`` (None: no limit) are
    in radians, for a prismatic joint in metres. ``damping`` is in N m s/rad or N s/m, ``friction`` and ``effort`` (the actuator
    limit) in N m or N, ``velocity`` (its limit) in rad/s or m/s.
    """

    name: str
    kind: JointKind
    parent: int
    child: int
    origin_m: np.ndarray
    axis: np.ndarray
    lower: float | None = None
    upper: float | None = None
    stands_at: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    effort: float | None = None
    velocity: float | None = None

    def motion(self, position: float) -> np.ndarray:
        """Return the motion ``(4, 4)`` of the child in the common frame from ``stands_at`` to ``position``, with the parent
        fixed.
        """
        return axis_motion(self.origin_m, self.axis, position - self.stands_at, slides=self.kind == "prismatic")

    def within(self, position: float) -> float:
        """Clip a position to the joint's limits."""
        low = -np.inf if self.lower is None else self.lower
        high = np.inf if self.upper is None else self.upper
        return float(np.clip(position, low, high))

    def moved(self, pose: np.ndarray) -> ArticulatedJoint:
        """Return the joint under a rigid transform ``(4, 4)`` of the common frame."""
        rotation = pose[:3, :3]
        return replace(self, origin_m=rotation @ self.origin_m + pose[:3, 3], axis=rotation @ self.axis)


@dataclass(frozen=True)
class ArticulatedBody:
    """Rigid links in one common frame, in their reference configuration, and their joints."""

    links: tuple[RigidBody, ...]
    joints: tuple[ArticulatedJoint, ...]


def link_motions(joints: Sequence[ArticulatedJoint], positions: Sequence[float]) -> np.ndarray:
    """Return the motion of each link ``(L, 4, 4)`` in the common frame from its reference pose, with the joints at ``positions
    (J,)``.

    The root does not move. ``joints`` must be ordered from the root outwards.
    """
    motions = np.tile(np.eye(4), (len(joints) + 1, 1, 1))
    for joint, position in zip(joints, positions, strict=True):
        motions[joint.child] = motions[joint.parent] @ joint.motion(position)
    return motions
