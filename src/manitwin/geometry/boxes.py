"""Bounding boxes, enclosing circles and mirror axes of points, and convex footprints on a plane."""

from __future__ import annotations

from itertools import permutations, product

import cv2
import numpy as np
from scipy.spatial import ConvexHull

from manitwin.geometry.poses import transform

ASKEW_SHARE = 0.9
"""A smallest rectangle with less than this share of the axis-aligned area means that the object is not aligned with the axes."""
_MIRRORED = 0.02  # fraction of the larger side: tolerated deviation of an outline from its mirror image
_MIRRORED_DIRECTIONS = 72


def box_corners(half_extents_m: np.ndarray, box_to_frame: np.ndarray) -> np.ndarray:
    """Return the eight corners ``(8, 3)`` of a box at a pose ``(4, 4)``."""
    signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    return (signs * half_extents_m) @ box_to_frame[:3, :3].T + box_to_frame[:3, 3]


def oriented_bounding_box(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest box ``(extents_m (3,), obb_to_object (4, 4))`` with a face flush with a facet of the convex hull.

    The box frame has its origin at the box's centre; among equivalent axis orders and signs, the one closest to the object's
    axes is chosen.

    Source: O'Rourke 1985 shows that the smallest box has edges of the hull on its faces; restricting it to boxes flush with a
    hull facet is the usual approximation. In the plane, rotating calipers are used (Toussaint 1983).
    """
    points = np.asarray(points, dtype=float)
    hull = ConvexHull(points)
    corners = points[hull.vertices]
    normals = np.vstack([np.eye(3), _distinct_directions(hull.equations[:, :3])])
    heights = np.ptp(corners @ normals.T, axis=0)
    # A rectangle is at least as large as the projection that it contains, which excludes most normals early.
    least = heights * _shadow_areas(points[hull.simplices], normals)
    least[:3] = 0  # the object's own axes come first: among equal boxes the first one is kept
    first, second = _plane_axes(normals)
    best_volume, best_axes = np.inf, np.eye(3)
    for index in np.argsort(least, kind="stable"):
        if least[index] >= best_volume:
            break
        flat = np.stack([corners @ first[index], corners @ second[index]], axis=1)
        area, along = _smallest_rectangle(flat)
        if area * heights[index] < best_volume * (1 - 1e-9):
            x = along[0] * first[index] + along[1] * second[index]
            best_volume, best_axes = area * heights[index], np.stack([x, np.cross(normals[index], x), normals[index]])
    axes = _nearest_to_identity(best_axes)
    local = corners @ axes.T
    low, high = local.min(0), local.max(0)
    return high - low, transform(axes.T, axes.T @ ((low + high) / 2))


def upright_extents(points: np.ndarray) -> np.ndarray:
    """Return length, width and height ``(3,)`` of an object standing on Z: the smallest rectangle seen from above, and the Z
    extent.

    This is what people measure. A minimum-volume box may lean, so that its longest side is a diagonal. The result does not
    change under rotation about Z.
    """
    points = np.asarray(points, dtype=float)
    _, along = _smallest_rectangle(points[:, :2])
    across = np.array([-along[1], along[0]])
    sides = sorted((float(np.ptp(points[:, :2] @ along)), float(np.ptp(points[:, :2] @ across))), reverse=True)
    return np.array([*sides, np.ptp(points[:, 2])])


def extents_along_sides(points: np.ndarray) -> np.ndarray:
    """Return length, width and height ``(3,)`` as people measure them: along the mirror axis of the outline seen from above.

    Among several mirror axes, the one with the smallest rectangle is used. Without a mirror axis the result is the extents
    along X, Y and Z, or ``upright_extents`` if the object is not aligned with the axes. A round object with a handle is thus
    measured from the handle to the far side, and an aircraft from nose to tail, although a smaller rectangle encloses each
    diagonally.
    """
    points = np.asarray(points, dtype=float)
    along_axes, upright = np.ptp(points, axis=0), upright_extents(points)
    along = mirror_axis(points[:, :2])
    if along is not None:
        sides = np.ptp(points[:, :2] @ np.stack([along, [-along[1], along[0]]], axis=1), axis=0)
        return np.array([sides.max(), sides.min(), upright[2]])
    is_askew = upright[0] * upright[1] < ASKEW_SHARE * along_axes[0] * along_axes[1]
    return upright if is_askew else along_axes


def turn_to_sides(points: np.ndarray) -> tuple[float, float]:
    """Return cosine and sine of the angle, at most 45 degrees, of the smallest rectangle around ``(N, 2)`` points to the axes."""
    _, along = _smallest_rectangle(np.asarray(points, dtype=float))
    across = np.array([-along[1], along[0]])
    cosine, sine = max((along, -along, across, -across), key=lambda side: float(side[0]))
    return float(cosine), float(sine)


def longest_edges(points: np.ndarray) -> np.ndarray:
    """Return the four parallel edges ``(4, 2, 3)`` along the longest side of the box of ``upright_extents``."""
    points = np.asarray(points, dtype=float)
    _, along = _smallest_rectangle(points[:, :2])
    axes = np.array([[*along, 0.0], [-along[1], along[0], 0.0], [0.0, 0.0, 1.0]])
    local = points @ axes.T
    low, high = local.min(0), local.max(0)
    longest = int(np.argmax(high - low))
    others = [axis for axis in range(3) if axis != longest]
    edges = np.empty((4, 2, 3))
    for number, corner in enumerate(product((0, 1), repeat=2)):
        for end, side in enumerate((low, high)):
            edges[number, end, longest] = side[longest]
            edges[number, end, others] = np.where(corner, high[others], low[others])
    return np.asarray(edges @ axes)


def smallest_enclosing_circle(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the smallest circle ``(center (2,), radius)`` that encloses points ``(N, 2)``.

    Source: Welzl 1991, in incremental form. The points are processed in the order of their hull, which makes the result
    deterministic.
    """
    points = np.unique(np.asarray(points, dtype=float), axis=0)
    if len(points) > 3 and np.linalg.matrix_rank(points - points.mean(0), tol=1e-12) == 2:
        points = points[ConvexHull(points).vertices]
    slack = 1e-10 * (np.ptp(points, axis=0).max() + 1e-12)
    center, radius = points[0], 0.0
    i = 0
    while (i := _next_outside(points, i + 1, len(points), center, radius + slack)) < len(points):
        center, radius = points[i], 0.0
        j = -1
        while (j := _next_outside(points, j + 1, i, center, radius + slack)) < i:
            center = (points[i] + points[j]) / 2
            radius = float(np.linalg.norm(points[i] - center))
            k = -1
            while (k := _next_outside(points, k + 1, j, center, radius + slack)) < j:
                center, radius = _circumcircle(points[i], points[j], points[k])
    return center, float(np.linalg.norm(points - center, axis=1).max())


def _next_outside(points: np.ndarray, first: int, end: int, center: np.ndarray, reach: float) -> int:
    """Return the index of the first point in ``first:end`` farther than ``reach`` from a centre; ``end`` if there is none."""
    away = points[first:end] - center
    outside = np.sqrt(away[:, 0] * away[:, 0] + away[:, 1] * away[:, 1]) > reach
    return first + int(outside.argmax()) if outside.any() else end


def _circumcircle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, float]:
    ab, ac = b - a, c - a
    double_area = 2 * (ab[0] * ac[1] - ab[1] * ac[0])
    if abs(double_area) < 1e-18:  # collinear: use the two points farthest apart
        ends = max(((a, b), (a, c), (b, c)), key=lambda pair: float(np.linalg.norm(pair[0] - pair[1])))
        return (ends[0] + ends[1]) / 2, float(np.linalg.norm(ends[0] - ends[1])) / 2
    x = (ac[1] * (ab @ ab) - ab[1] * (ac @ ac)) / double_area
    y = (ab[0] * (ac @ ac) - ac[0] * (ab @ ab)) / double_area
    return a + np.array([x, y]), float(np.hypot(x, y))


def _distinct_directions(normals: np.ndarray) -> np.ndarray:
    """Return at most 256 normals, merging those that are equal up to sign and half a degree."""
    signs = np.sign(normals[np.arange(len(normals)), np.abs(normals).argmax(1)])
    cells = np.round(normals * signs[:, None] / 0.01)
    kept = np.sort(np.unique(cells, axis=0, return_index=True)[1])
    return normals[kept[np.linspace(0, len(kept) - 1, min(len(kept), 256)).astype(int)]]


def _shadow_areas(triangles: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the areas ``(N,)`` of a convex surface ``(F, 3, 3)`` projected along normals ``(N, 3)``."""
    areas = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) / 2
    return np.abs(areas @ normals.T).sum(0) / 2  # every line through the body crosses its surface twice


def _plane_axes(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors ``(N, 3)`` each that span the planes of the normals."""
    first = np.cross(normals, np.eye(3)[np.abs(normals).argmin(1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normals, first)


def _smallest_rectangle(points: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the area of the smallest rectangle around points ``(N, 2)`` and the direction ``(2,)`` of one side."""
    # OpenCV's hull is about ten times faster than Qhull. It uses float32, which may drop one of two corners that are 1e-7
    # apart; the coordinates of the kept corners are used in full precision.
    outline = points[cv2.convexHull((points - points[0]).astype(np.float32), returnPoints=False)[:, 0]]
    edges = np.concatenate([outline[1:], outline[:1]]) - outline
    edges /= np.maximum(np.hypot(edges[:, 0], edges[:, 1]), 1e-300)[:, None]
    along, across = outline @ edges.T, outline @ (edges[:, ::-1] * [-1.0, 1.0]).T
    areas = (along.max(0) - along.min(0)) * (across.max(0) - across.min(0))
    best = int(areas.argmin())
    return float(areas[best]), edges[best]


def mirror_axis(points: np.ndarray) -> np.ndarray | None:
    """Return the direction ``(2,)`` of a mirror axis of the outline of points ``(N, 2)``, or of its normal; None if there is
    none.

    The candidates are X, a side of the smallest rectangle, and the axis of least second moment of area of the outline. Among
    several mirror axes, the one with the smallest rectangle is returned.
    """
    outline = points[cv2.convexHull((points - points[0]).astype(np.float32), returnPoints=False)[:, 0]]
    tried = [np.array([1.0, 0.0]), _smallest_rectangle(points)[1], *_principal_axis(outline)]
    found = []
    for along in tried:
        local = outline @ np.stack([along, [-along[1], along[0]]], axis=1)
        low, high = local.min(0), local.max(0)
        if _is_mirrored(local - (low + high) / 2, float((high - low).max())):
            found.append((float(np.prod(high - low)), along))
    return min(found, key=lambda each: each[0])[1] if found else None


def _principal_axis(outline: np.ndarray) -> list[np.ndarray]:
    """Return the axis ``(2,)`` of least second moment of area of a convex polygon ``(K, 2)``; an empty list for a degenerate
    one.
    """
    arms = outline - outline.mean(0)
    ahead = np.roll(arms, -1, axis=0)
    doubled = np.abs(
        arms[:, 0] * ahead[:, 1] - arms[:, 1] * ahead[:, 0]
    )  # twice the area of the triangle to the middle
    if doubled.sum() < 1e-12 * float(np.ptp(outline, axis=0).max()) ** 2:
        return []
    corners, sums = np.stack([arms, ahead], axis=1), arms + ahead
    second = np.einsum("n,nki,nkj->ij", doubled, corners, corners) + np.einsum("n,ni,nj->ij", doubled, sums, sums)
    center = (sums * doubled[:, None]).sum(0) / (3 * doubled.sum())
    moments = second / 24 - np.outer(center, center) * doubled.sum() / 2
    return [np.asarray(np.linalg.eigh(moments)[1][:, 1])]


def _is_mirrored(outline: np.ndarray, size: float) -> bool:
    """Return whether a convex outline ``(K, 2)`` centred on the origin is symmetric about X or Y."""
    angles = 2 * np.pi * np.arange(_MIRRORED_DIRECTIONS) / _MIRRORED_DIRECTIONS
    directions = np.stack([np.cos(angles), np.sin(angles)])
    reach = (outline @ directions).max(0)
    apart = [np.abs((outline * sign @ directions).max(0) - reach).max() for sign in ([1.0, -1.0], [-1.0, 1.0])]
    return bool(min(apart) <= _MIRRORED * size)


def _nearest_to_identity(axes: np.ndarray) -> np.ndarray:
    """Return the same axes, permuted and flipped to the right-handed frame closest to the identity."""
    best = max(permutations(range(3)), key=lambda order: float(np.abs(np.diag(axes[list(order)])).sum()))
    named = axes[list(best)]
    diagonal = np.diag(named)
    named = named * np.where(diagonal < 0, -1.0, 1.0)[:, None]
    if np.linalg.det(named) < 0:
        named[int(np.abs(diagonal).argmin())] *= -1
    return named


def footprint(points_m: np.ndarray) -> np.ndarray:
    """Return the corners ``(K, 2)``, counter-clockwise, of the convex hull of points ``(N, 3)`` projected along Z."""
    flat = points_m[:, :2]
    return flat[ConvexHull(flat).vertices]


def separation_m(first: np.ndarray, second: np.ndarray) -> float:
    """Return a lower bound of the distance between two convex polygons ``(K, 2)``, negative if they overlap.

    It is the largest gap along the edge normals (separating axes). It equals the distance unless the closest points are two
    corners, in which case it is smaller.
    """
    return float(separations_m(first, second, np.zeros((1, 2)))[0])


def separations_m(first: np.ndarray, second: np.ndarray, offsets_m: np.ndarray) -> np.ndarray:
    """Return ``separation_m`` ``(N,)`` of two convex polygons, with the first translated by each of the offsets ``(N, 2)``."""
    gaps = []
    for one, other, sign in ((first, second, -1.0), (second, first, 1.0)):
        edges = np.roll(one, -1, axis=0) - one
        normals = np.stack([edges[:, 1], -edges[:, 0]], 1)
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        here = (other @ normals.T).min(0) - (one * normals).sum(1)
        gaps.append((here + sign * (offsets_m @ normals.T)).max(1))
    return np.asarray(np.maximum(*gaps))
