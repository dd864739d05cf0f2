"""Smallest boxes and circles around points."""

from __future__ import annotations

from itertools import permutations

import numpy as np
from scipy.spatial import ConvexHull

from manitwin.geometry.poses import transform


def oriented_bounding_box(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest box ``(extents_m (3,), obb_to_object (4, 4))`` that has a face in a plane of the convex hull.

    The box frame has its origin at the box's centre; of its equal namings of axes it is the one closest to the
    object's axes.
    Source: O'Rourke 1985 shows that the smallest box touches the hull with edges; boxes flush with a hull face are
    the usual approximation; in the plane, rotating calipers (Toussaint 1983).
    """
    points = np.asarray(points, dtype=float)
    hull = ConvexHull(points)
    corners = points[hull.vertices]
    normals = _distinct_directions(hull.equations[:, :3])
    best_volume, best_axes = np.inf, np.eye(3)
    for normal in np.vstack([np.eye(3), normals]):
        axes = _smallest_rectangle_axes(corners, normal)
        volume = float(np.prod(np.ptp(corners @ axes.T, axis=0)))
        if volume < best_volume * (1 - 1e-9):
            best_volume, best_axes = volume, axes
    axes = _nearest_to_identity(best_axes)
    local = corners @ axes.T
    low, high = local.min(0), local.max(0)
    return high - low, transform(axes.T, axes.T @ ((low + high) / 2))


def smallest_enclosing_circle(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the smallest circle ``(center (2,), radius)`` that holds points ``(N, 2)``.

    Source: Welzl 1991, the incremental form; the points are taken in the order of their hull, so the answer is
    repeatable.
    """
    points = np.unique(np.asarray(points, dtype=float), axis=0)
    if len(points) > 3 and np.linalg.matrix_rank(points - points.mean(0), tol=1e-12) == 2:
        points = points[ConvexHull(points).vertices]
    slack = 1e-10 * (np.ptp(points, axis=0).max() + 1e-12)
    center, radius = points[0], 0.0
    for i in range(1, len(points)):
        if _inside(points[i], center, radius, slack):
            continue
        center, radius = points[i], 0.0
        for j in range(i):
            if _inside(points[j], center, radius, slack):
                continue
            center = (points[i] + points[j]) / 2
            radius = float(np.linalg.norm(points[i] - center))
            for k in range(j):
                if not _inside(points[k], center, radius, slack):
                    center, radius = _circumcircle(points[i], points[j], points[k])
    return center, float(np.linalg.norm(points - center, axis=1).max())


def _inside(point: np.ndarray, center: np.ndarray, radius: float, slack: float) -> bool:
    return float(np.linalg.norm(point - center)) <= radius + slack


def _circumcircle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, float]:
    ab, ac = b - a, c - a
    double_area = 2 * (ab[0] * ac[1] - ab[1] * ac[0])
    if abs(double_area) < 1e-18:  # on one line: the two farthest apart
        ends = max(((a, b), (a, c), (b, c)), key=lambda pair: float(np.linalg.norm(pair[0] - pair[1])))
        return (ends[0] + ends[1]) / 2, float(np.linalg.norm(ends[0] - ends[1])) / 2
    x = (ac[1] * (ab @ ab) - ab[1] * (ac @ ac)) / double_area
    y = (ab[0] * (ac @ ac) - ac[0] * (ab @ ab)) / double_area
    return a + np.array([x, y]), float(np.hypot(x, y))


def _distinct_directions(normals: np.ndarray) -> np.ndarray:
    """Return the normals without those equal, up to sign and half a degree, to one kept; at most 256 of them."""
    signs = np.sign(normals[np.arange(len(normals)), np.abs(normals).argmax(1)])
    cells = np.round(normals * signs[:, None] / 0.01)
    kept = np.sort(np.unique(cells, axis=0, return_index=True)[1])
    return normals[kept[np.linspace(0, len(kept) - 1, min(len(kept), 256)).astype(int)]]


def _smallest_rectangle_axes(corners: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return axes (rows) of the box around ``corners`` that has a face normal to ``normal`` and the smallest base."""
    first = np.cross(normal, np.eye(3)[int(np.abs(normal).argmin())])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    flat = np.stack([corners @ first, corners @ second], axis=1)
    outline = flat[ConvexHull(flat).vertices]
    edges = np.roll(outline, -1, axis=0) - outline
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    across = np.stack([-edges[:, 1], edges[:, 0]], axis=1)
    area = np.ptp(outline @ edges.T, axis=0) * np.ptp(outline @ across.T, axis=0)
    along = edges[int(area.argmin())]
    x = along[0] * first + along[1] * second
    return np.stack([x, np.cross(normal, x), normal])


def _nearest_to_identity(axes: np.ndarray) -> np.ndarray:
    """Return the same axes, permuted and flipped to a right-handed frame as close to the object's as can be."""
    best = max(permutations(range(3)), key=lambda order: float(np.abs(np.diag(axes[list(order)])).sum()))
    named = axes[list(best)]
    diagonal = np.diag(named)
    named = named * np.where(diagonal < 0, -1.0, 1.0)[:, None]
    if np.linalg.det(named) < 0:
        named[int(np.abs(diagonal).argmin())] *= -1
    return named
