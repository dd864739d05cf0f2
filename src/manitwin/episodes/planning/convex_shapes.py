"""Objects as coal's convex shapes, kept from one problem to the next."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from manitwin.episodes.planning.libraries import coal
from manitwin.geometry.boxes import box_corners
from manitwin.geometry.rigid_body import RigidBody

KEPT_BODIES = 256
SOLID_SHARE = 0.7  # of the common hull's volume that the hulls must fill for it to stand for them near the hand


def convex_hull(points: np.ndarray) -> Any:
    """Return the convex hull of points ``(N, 3)`` m as coal's shape, its bounding box computed."""
    vertices = coal.StdVec_Vec3s()
    for point in np.asarray(points, float):
        vertices.append(point)
    shape = coal.ConvexBase.convexHull(vertices, True, None)
    shape.computeLocalAABB()
    return shape


def corners_of(shape: Any) -> np.ndarray | None:
    """Return the corners ``(N, 3)`` of one of pinocchio's shapes in the frame of its joint; None for what has none."""
    if isinstance(shape.geometry, coal.Box):
        local = box_corners(shape.geometry.halfSide, np.eye(4))
    elif isinstance(shape.geometry, coal.ConvexBase):
        local = np.array([shape.geometry.point(i) for i in range(shape.geometry.num_points)])
    else:
        return None
    return local @ shape.placement.rotation.T + shape.placement.translation


@dataclass(frozen=True)
class ConvexBody:
    """A body's hulls and the one hull of all of them, in the object frame."""

    body: RigidBody

    @cached_property
    def hulls(self) -> tuple[Any, ...]:
        """The body's own hulls."""
        return tuple(convex_hull(vertices) for vertices in self.body.hulls)

    @cached_property
    def _whole(self) -> ConvexHull:
        return ConvexHull(np.concatenate(self.body.hulls))

    @cached_property
    def whole(self) -> Any:
        """The hull of all points."""
        return convex_hull(self._whole.points[self._whole.vertices])

    @cached_property
    def is_solid(self) -> bool:
        """True where the one hull stands well for the hulls: it adds little room that a hand could use."""
        return sum(ConvexHull(vertices).volume for vertices in self.body.hulls) >= SOLID_SHARE * self._whole.volume

    @cached_property
    def radius_m(self) -> float:
        """The distance of the farthest point from the object frame's origin."""
        return float(np.linalg.norm(self._whole.points, axis=1).max())


class ShapeStore:
    """Makes the shapes of bodies once, and keeps those last used; a body is known by its identity."""

    def __init__(self) -> None:
        self._kept: OrderedDict[int, ConvexBody] = OrderedDict()

    def __call__(self, body: RigidBody) -> ConvexBody:
        """Return the shapes of this very body."""
        key = id(body)  # the kept shapes hold the body, so that its identity is not given to another
        if key not in self._kept:
            self._kept[key] = ConvexBody(body)
            if len(self._kept) > KEPT_BODIES:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]
