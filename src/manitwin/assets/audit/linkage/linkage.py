"""Rigid parts of an asset and the joints between them, in the pose at loading.

Links connected by fixed joints form one part. All geometry is in one frame, that of the file's root (URDF, SDF) or the world
(MJCF), with every joint at zero or, if its limits exclude zero, at the nearer limit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.geometry.articulation import axis_motion

SLIDES = ("prismatic", "slide")
TURNS = ("revolute", "hinge", "continuous")


@dataclass(frozen=True)
class Part:
    """A rigid part: the vertices ``(V, 3)`` m of each convex collision shape."""

    name: str
    shapes: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class MovingJoint:
    """A joint between two parts, given by their indices in ``Linkage.parts``.

    ``point (3,)`` lies on the unit ``axis (3,)``, both in the pose at loading. ``start`` is the joint position in that pose, in
    rad or m like ``lower`` and ``upper``, which are None without limits.
    """

    name: str
    kind: str
    parent: int
    child: int
    point: np.ndarray
    axis: np.ndarray
    start: float = 0.0
    lower: float | None = None
    upper: float | None = None

    def displacement(self, by: float) -> np.ndarray:
        """Return the transform ``(4, 4)`` that moves the child from its start pose by this many rad or m."""
        return axis_motion(self.point, self.axis, by, slides=self.kind in SLIDES)


@dataclass(frozen=True)
class Overlap:
    """Two parts, or a part and the ground, that penetrate each other by ``depth_m`` at loading."""

    one: str
    other: str
    depth_m: float


@dataclass(frozen=True)
class Linkage:
    """The parts, the joints between them, and the overlaps that the engine finds at loading.

    ``overlaps``: as MuJoCo finds them with the file's own exclusions and ground; None for formats whose engines leave collision
    filtering to the loader. ``collide``: the file, or its usual loaders, let parts of one asset collide with each other.
    """

    parts: tuple[Part, ...]
    joints: tuple[MovingJoint, ...]
    overlaps: tuple[Overlap, ...] | None = None
    collide: bool = True

    def joints_of_child(self, part: int) -> list[MovingJoint]:
        """Return the joints whose child is a part."""
        return [joint for joint in self.joints if joint.child == part]

    def moved_parts(self, joint: MovingJoint) -> list[int]:
        """Return the parts that a joint moves: its child and all descendants."""
        carried = [joint.child]
        for part in carried:
            carried += [each.child for each in self.joints if each.parent == part and each.child not in carried]
        return carried
