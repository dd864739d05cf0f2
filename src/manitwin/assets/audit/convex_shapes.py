"""Convex hulls of collision shapes as simulators build them: half-spaces, mass moments and line intersections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull, QhullError

_PAIRS_PER_CHUNK = 2_000_000  # (point, plane) pairs at once: bounds memory use


@dataclass(frozen=True)
class UniformSolid:
    """Volume, centre of mass ``(3,)`` and inertia about it per kilogram, ``(3, 3)`` m2."""

    volume_m3: float
    center_of_mass_m: np.ndarray
    inertia_per_kg_m2: np.ndarray


@dataclass(frozen=True)
class ConvexShapes:
    """Convex hulls: outward ``planes (P, 4)``, those of hull ``i`` from ``starts[i]`` on; ``boxes (H, 2, 3)``.

    ``flat`` are the indices of given shapes without volume, which are left out; ``kept`` those of the others, and ``corners``
    the numbers of their hull vertices.
    """

    planes: np.ndarray
    starts: np.ndarray
    triangles: np.ndarray
    volumes_m3: np.ndarray
    interior: np.ndarray
    boxes: np.ndarray
    flat: tuple[int, ...]
    kept: tuple[int, ...]
    corners: tuple[int, ...] = ()

    @classmethod
    def from_vertices(cls, shapes: Sequence[np.ndarray]) -> ConvexShapes:
        """Compute the hulls of shapes, each given by vertices ``(V, 3)`` m."""
        planes, triangles, volumes, interior, boxes = [], [], [], [], []
        flat, kept, corners = [], [], []
        for index, vertices in enumerate(shapes):
            try:
                hull = ConvexHull(vertices)
            except (QhullError, ValueError):  # ValueError: fewer than four points
                flat.append(index)
                continue
            kept.append(index)
            corners.append(len(hull.vertices))
            planes.append(hull.equations)
            boxes.append([hull.min_bound, hull.max_bound])
            triangles.append(vertices[hull.simplices])
            volumes.append(hull.volume)
            interior.append(np.repeat(vertices[hull.vertices].mean(0)[None], len(hull.simplices), axis=0))
        starts = np.cumsum([0, *map(len, planes)])[:-1]
        return cls(
            planes=np.concatenate(planes) if planes else np.zeros((0, 4)),
            starts=starts,
            triangles=np.concatenate(triangles) if triangles else np.zeros((0, 3, 3)),
            volumes_m3=np.array(volumes),
            interior=np.concatenate(interior) if interior else np.zeros((0, 3)),
            boxes=np.array(boxes).reshape(-1, 2, 3),
            flat=tuple(flat),
            kept=tuple(kept),
            corners=tuple(corners),
        )

    def __len__(self) -> int:
        return len(self.volumes_m3)

    @cached_property
    def uniform_solid(self) -> UniformSolid:
        """The union of all shapes with uniform density; overlaps count twice.

        Source: second moments of tetrahedra, V/20 (sum of v v^T + s s^T) over the four corners, s their sum.
        """
        corners = np.concatenate([self.triangles, self.interior[:, None]], axis=1)
        edges = corners[:, :3] - corners[:, 3:]
        volumes = np.abs(np.einsum("ij,ij->i", edges[:, 0], np.cross(edges[:, 1], edges[:, 2]))) / 6
        volume = float(volumes.sum())
        center = np.einsum("t,tj->j", volumes, corners.mean(1)) / volume
        corners = corners - center
        total = corners.sum(1)
        second = np.einsum("t,tij,tik->jk", volumes, corners, corners) + np.einsum("t,tj,tk->jk", volumes, total, total)
        return UniformSolid(volume, center, inertia_of_second_moment(second / (20 * volume)))

    def depth_outside(self, points: np.ndarray) -> np.ndarray:
        """Return a lower bound for the distance of points ``(N, 3)`` outside all shapes, ``(N,)`` m; negative inside one.

        Outside, it is the distance to the farthest plane of the nearest shape, which never exceeds the true distance.
        """
        result = np.empty(len(points))
        chunk = max(1, _PAIRS_PER_CHUNK // max(1, len(self.planes)))
        for start in range(0, len(points), chunk):
            part = points[start : start + chunk]
            beyond = self.planes[:, :3] @ part.T + self.planes[:, 3:]
            result[start : start + chunk] = np.maximum.reduceat(beyond, self.starts, axis=0).min(0)
        return result

    def is_within(self, points: np.ndarray, tolerance_m: float = 0.0) -> np.ndarray:
        """Return which points ``(N, 3)`` lie inside a shape with planes moved outward by ``tolerance_m``, ``(N,) bool``."""
        inside = np.zeros(len(points), dtype=bool)
        ends = np.append(self.starts, len(self.planes))[1:]
        for start, end, (low, high) in zip(self.starts, ends, self.boxes, strict=True):
            in_box = (points >= low - tolerance_m).all(1) & (points <= high + tolerance_m).all(1)
            near = np.flatnonzero(in_box & ~inside)
            if len(near):
                planes = self.planes[start:end]
                inside[near] = (points[near] @ planes[:, :3].T + planes[:, 3] <= tolerance_m).all(1)
        return inside

    def line_intervals(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the entry and exit parameters of lines for every shape, ``(N, H)`` each, along unit ``directions (N, 3)``.

        If a line misses a shape, entry is not before exit. Source: Cyrus and Beck 1978, clipping by half-spaces.
        """
        along = self.planes[:, :3] @ directions.T
        offset = self.planes[:, :3] @ origins.T + self.planes[:, 3:]
        parallel = np.abs(along) < 1e-12
        crossing = -offset / np.where(parallel, 1.0, along)
        enter = np.where(parallel, np.where(offset > 0, np.inf, -np.inf), np.where(along < 0, crossing, -np.inf))
        leave = np.where(parallel | (along < 0), np.inf, crossing)
        return (
            np.maximum.reduceat(enter, self.starts, axis=0).T,
            np.minimum.reduceat(leave, self.starts, axis=0).T,
        )


def inertia_of_second_moment(second: np.ndarray) -> np.ndarray:
    """Return the inertia ``(3, 3)`` for a second moment of mass ``(3, 3)`` about the same point."""
    return np.trace(second) * np.eye(3) - second
