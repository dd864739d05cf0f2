"""Holes between convex hulls: tests whether a rod passes through, and whether a point is enclosed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial import ConvexHull

from manitwin.geometry.poses import transform

_TURNS = 24


def rod_passes(
    hulls: Sequence[np.ndarray], center_m: np.ndarray, axis: np.ndarray, radius_m: float, half_length_m: float
) -> bool:
    """Return whether a rod along ``axis (3,)`` through a point does not intersect any of the hulls, each ``(V, 3)`` m.

    Exact: the section of each hull within the rod's length is projected along the axis. A rod that touches a hull passes.
    """
    return not any(_meets(seen, radius_m) for seen in _along(hulls, center_m, axis, half_length_m))


def _along(
    hulls: Sequence[np.ndarray], center_m: np.ndarray, axis: np.ndarray, half_length_m: float
) -> Iterator[np.ndarray]:
    """Yield, for each hull cut to a slab across the axis, the projected points ``(N, 2)`` whose convex hull it covers."""
    z = axis / np.linalg.norm(axis)
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    frame = np.stack([x / np.linalg.norm(x), np.cross(z, x) / np.linalg.norm(x), z], axis=1)
    for hull in hulls:
        points = (hull - center_m) @ frame
        edges = ConvexHull(hull).simplices[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        seen = [points[np.abs(points[:, 2]) < half_length_m]]
        for height in (-half_length_m, half_length_m):
            start, end = points[edges[:, 0]], points[edges[:, 1]]
            crossing = (start[:, 2] < height) != (end[:, 2] < height)
            start, end = start[crossing], end[crossing]
            seen.append(start + ((height - start[:, 2]) / (end[:, 2] - start[:, 2]))[:, None] * (end - start))
        found = np.concatenate(seen)[:, :2]
        if len(found):
            yield found


def _meets(points: np.ndarray, radius_m: float) -> bool:
    """Return whether the convex hull of points ``(N, 2)`` meets a disc about the origin.

    They are disjoint if some direction has all points beyond the disc. Each point allows an arc of such directions, none longer
    than half a turn; the hull meets the disc if the arcs have no common direction.
    """
    away = np.linalg.norm(points, axis=1)
    if (away <= radius_m).any():
        return True
    angle, half = np.arctan2(points[:, 1], points[:, 0]), np.arccos(radius_m / away)
    turned = np.mod(angle - angle[0] + np.pi, 2 * np.pi) - np.pi
    return bool((turned - half).max() > (turned + half).min())


def enclosed_share(hulls: Sequence[np.ndarray], point_m: np.ndarray, axis: np.ndarray, reach_m: float) -> float:
    """Return the share of 24 rays from a point, perpendicular to ``axis (3,)``, that meet a hull within ``reach_m``."""
    ways = _ways_m(hulls, point_m, _around(axis))
    return float((ways <= reach_m).mean())


def free_way_m(hulls: Sequence[np.ndarray], point_m: np.ndarray, direction: np.ndarray) -> float:
    """Return the distance (m) from a point to the first hull along ``direction (3,)``; infinity if there is none."""
    return float(_ways_m(hulls, point_m, direction[None] / np.linalg.norm(direction))[0])


def _ways_m(hulls: Sequence[np.ndarray], point_m: np.ndarray, rays: np.ndarray) -> np.ndarray:
    """Return the distances at which unit rays ``(N, 3)`` from a point enter a hull, by Cyrus-Beck clipping against its planes."""
    ways = np.full(len(rays), np.inf)
    for hull in hulls:
        planes = ConvexHull(hull).equations
        slope, height = rays @ planes[:, :3].T, planes[:, :3] @ point_m + planes[:, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            at = -height / slope
        enters = np.where(slope < 0, at, 0.0).max(1, initial=0.0)
        leaves = np.where(slope > 0, at, np.inf).min(1)
        outside = ((slope == 0) & (height > 0)).any(1)
        ways = np.minimum(ways, np.where(~outside & (enters <= leaves), enters, np.inf))
    return ways


def _around(axis: np.ndarray) -> np.ndarray:
    """Return 24 unit vectors ``(24, 3)`` perpendicular to an axis."""
    z = axis / np.linalg.norm(axis)
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    frame = transform(np.stack([x / np.linalg.norm(x), np.cross(z, x) / np.linalg.norm(x), z], axis=1))
    angle = np.arange(_TURNS) * 2 * np.pi / _TURNS
    return np.cos(angle)[:, None] * frame[:3, 0] + np.sin(angle)[:, None] * frame[:3, 1]
