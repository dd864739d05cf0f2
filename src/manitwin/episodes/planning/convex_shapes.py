"""Convex shapes of objects for coal, cached between problems."""

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
# least share of the convex hull's volume that the hulls must fill for it to replace them near the hand
SOLID_SHARE = 0.7


def convex_hull(points: np.ndarray) -> Any:
    """Return the convex hull of points ``(N, 3)`` m as a coal shape, with its bounding box computed."""
    vertices = coal.StdVec_Vec3s()
    for point in np.asarray(points, float):
        vertices.append(point)
    shape = coal.ConvexBase.convexHull(vertices, True, None)
    shape.computeLocalAABB()
    return shape


def corners_of(shape: Any) -> np.ndarray | None:
    """Return the vertices ``(N, 3)`` of a pinocchio shape in its joint's frame; None for a shape without vertices."""
    if isinstance(shape.geometry, coal.Box):
        local = box_corners(shape.geometry.halfSide, np.eye(4))
    elif isinstance(shape.geometry, coal.ConvexBase):
        local = np.array([shape.geometry.point(i) for i in range(shape.geometry.num_points)])
    else:
        return None
    return local @ shape.placement.rotation.T + shape.placement.translation


@dataclass(frozen=True)
class ConvexBody:
    """A body's hulls and the convex hull of all of them, in the object frame."""

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
        """The convex hull of all vertices."""
        return convex_hull(self._whole.points[self._whole.vertices])

    @cached_property
    def is_solid(self) -> bool:
        """Whether the convex hull is a good substitute for the hulls: it adds little volume that a hand could use."""
        return sum(ConvexHull(vertices).volume for vertices in self.body.hulls) >= SOLID_SHARE * self._whole.volume

    @cached_property
    def radius_m(self) -> float:
        """Distance of the farthest vertex from the object frame's origin."""
        return float(np.linalg.norm(self._whole.points, axis=1).max())


class ShapeStore:
    """LRU cache of the shapes of bodies, by object identity."""

    def __init__(self) -> None:
        self._kept: OrderedDict[int, ConvexBody] = OrderedDict()

    def __call__(self, body: RigidBody) -> ConvexBody:
        """Return the shapes of a body."""
        key = id(body)  # the cached shapes keep the body alive, so that its id is not reused
        if key not in self._kept:
            self._kept[key] = ConvexBody(body)
            if len(self._kept) > KEPT_BODIES:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]
