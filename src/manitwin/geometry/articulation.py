"""Rigid links that joints with one degree of freedom hold together: a tree whose first link is its root."""

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
    """Return the motion ``(4, 4)`` by ``way`` m along a unit axis, or rad right-handed about it through ``origin_m``."""
    if slides:
        return transform(None, way * axis)
    rotation = Rotation.from_rotvec(way * axis).as_matrix()
    return transform(rotation, origin_m - rotation @ origin_m)


@dataclass(frozen=True)
class ArticulatedJoint:
    """One joint between the links ``parent`` and ``child``, by their places in the tree's order, parents first.

    ``origin_m (3,)`` lies on its axis and ``axis (3,)`` is of length one, both in one frame for all links, which stand as they
    stand when the joint is at ``stands_at``. Positions and the limits ``lower`` and ``upper`` (None: no limit) are radians, of a
    prismatic joint metres; ``damping`` is N m s/rad or N s/m, ``friction`` and ``effort`` (the most that a motor gives) N m or N,
    ``velocity`` (the most that it may have) rad/s or m/s.
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
        """Return the motion ``(4, 4)`` of the child in the common frame, the parent held, from ``stands_at`` to ``position``."""
        return axis_motion(self.origin_m, self.axis, position - self.stands_at, slides=self.kind == "prismatic")

    def within(self, position: float) -> float:
        """Return the position within the limits that is nearest to ``position``."""
        low = -np.inf if self.lower is None else self.lower
        high = np.inf if self.upper is None else self.upper
        return float(np.clip(position, low, high))

    def moved(self, pose: np.ndarray) -> ArticulatedJoint:
        """Return the joint under a rigid transform ``(4, 4)`` of the common frame."""
        rotation = pose[:3, :3]
        return replace(self, origin_m=rotation @ self.origin_m + pose[:3, 3], axis=rotation @ self.axis)


@dataclass(frozen=True)
class ArticulatedBody:
    """Links as rigid bodies in one frame, as they stand, and their joints."""

    links: tuple[RigidBody, ...]
    joints: tuple[ArticulatedJoint, ...]


def link_motions(joints: Sequence[ArticulatedJoint], positions: Sequence[float]) -> np.ndarray:
    """Return how each link moves ``(L, 4, 4)`` in the common frame from where it stands, the joints at ``positions`` (J,).

    The root stays. ``joints`` are in an order in which the joint that holds a link comes before those that it holds.
    """
    motions = np.tile(np.eye(4), (len(joints) + 1, 1, 1))
    for joint, position in zip(joints, positions, strict=True):
        motions[joint.child] = motions[joint.parent] @ joint.motion(position)
    return motions
