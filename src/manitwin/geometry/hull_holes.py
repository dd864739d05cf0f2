"""Holes between convex hulls: does a rod fit through, and is a point enclosed by them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import ConvexHull

from manitwin.geometry.poses import transform

_TURNS, _LAYERS = 24, 9
_SHARES = (0.0, 0.5, 1.0)  # of the rod's radius, at which its cross-section is looked at


def rod_passes(
    hulls: Sequence[np.ndarray], center_m: np.ndarray, axis: np.ndarray, radius_m: float, half_length_m: float
) -> bool:
    """Tell whether a rod along an axis ``(3,)`` through a point stays outside of all hulls, each ``(V, 3)`` m.

    It is looked at in 9 layers of 49 points.
    """
    around = _around(axis)
    layers = np.linspace(-half_length_m, half_length_m, _LAYERS)
    disc = np.concatenate([share * radius_m * around for share in _SHARES])
    points = center_m + (layers[:, None, None] * axis + disc[None]).reshape(-1, 3)
    for hull in hulls:
        planes = ConvexHull(hull).equations
        if (points @ planes[:, :3].T + planes[:, 3] < 0).all(1).any():
            return False
    return True


def enclosed_share(hulls: Sequence[np.ndarray], point_m: np.ndarray, axis: np.ndarray, reach_m: float) -> float:
    """Return the share of 24 rays from a point across an axis ``(3,)`` that meet a hull within ``reach_m``."""
    ways = _ways_m(hulls, point_m, _around(axis))
    return float((ways <= reach_m).mean())


def free_way_m(hulls: Sequence[np.ndarray], point_m: np.ndarray, direction: np.ndarray) -> float:
    """Return how far from a point one meets a hull in a direction ``(3,)`` (m); infinity where there is none."""
    return float(_ways_m(hulls, point_m, direction[None] / np.linalg.norm(direction))[0])


def _ways_m(hulls: Sequence[np.ndarray], point_m: np.ndarray, rays: np.ndarray) -> np.ndarray:
    """Return how far unit rays ``(N, 3)`` from a point come until they enter a hull: Cyrus and Beck's clipping by its planes."""
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
    """Return unit vectors ``(24, 3)`` across an axis."""
    z = axis / np.linalg.norm(axis)
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    frame = transform(np.stack([x / np.linalg.norm(x), np.cross(z, x) / np.linalg.norm(x), z], axis=1))
    angle = np.arange(_TURNS) * 2 * np.pi / _TURNS
    return np.cos(angle)[:, None] * frame[:3, 0] + np.sin(angle)[:, None] * frame[:3, 1]
