"""Boxes seen from a corner: the six corners of the silhouette determine the sides.

For a box with sides l and rotation R, a parallel projection shows the three edges at a corner as the columns of P = R[:2]
diag(l). The rows of R are orthonormal, so P diag(1 / l^2) P^T is a multiple of the identity: three linear equations for 1 /
l^2.
"""

from __future__ import annotations

import cv2
import numpy as np

from manitwin.models.generators.templates.fitting.fit import LEAST_CONFIDENCE, TemplateFit, fit

BOX = "box"
CORNERS = 6
LEAST_POLYGON_IOU = 0.965
"""Minimum overlap of the silhouette with the hexagon of its corners; a silhouette that is round between them is no box."""
LEAST_SIDE_SHARE = 0.03  # of the outline's length
MOST_TURN_DEG, MOST_UNEQUAL = 40.0, 0.6
"""Maximum differences of opposite sides of a box by perspective: in direction, and in length relative to their mean."""
_TOLERANCES = np.geomspace(0.004, 0.05, 24)  # of the outline's length


def fit_corner_box(rgba: np.ndarray, focal_mm: float | None = None) -> TemplateFit | None:
    """Return the box that explains ``rgba (H, W, 4) uint8``, whose alpha is the mask; None for another silhouette."""
    corners = six_corners(rgba[..., 3] > 127)
    sides = None if corners is None else box_sides(corners)
    if sides is None:
        return None
    width, depth, height = sides
    found = fit(BOX, rgba, {"width": width / height, "depth": depth / height}, focal_mm=focal_mm)
    return found if found is not None and found.confidence >= LEAST_CONFIDENCE else None


def six_corners(mask: np.ndarray) -> np.ndarray | None:
    """Return the corners ``(6, 2)`` (x, y) of the silhouette ``(H, W) bool`` if it is a convex hexagon, else None."""
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return None
    hull = cv2.convexHull(max(contours, key=cv2.contourArea))
    length_px = cv2.arcLength(hull, closed=True)
    for tolerance in _TOLERANCES:
        corners = cv2.approxPolyDP(hull, tolerance * length_px, closed=True)[:, 0].astype(float)
        if len(corners) <= CORNERS:
            break
    if len(corners) != CORNERS:
        return None
    drawn = np.zeros(mask.shape, np.uint8)
    cv2.fillConvexPoly(drawn, np.rint(corners).astype(np.int32), 1)
    agreed = (mask & (drawn > 0)).sum() / (mask | (drawn > 0)).sum()
    shortest_px = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).min()
    return corners if agreed >= LEAST_POLYGON_IOU and shortest_px >= LEAST_SIDE_SHARE * length_px else None


def box_sides(corners: np.ndarray) -> tuple[float, float, float] | None:
    """Return width, depth and height, up to scale, of the box with silhouette ``corners (6, 2)``; None if it is no box.

    The height is the edge nearest to the vertical of the picture.
    """
    edges = np.roll(corners, -1, axis=0) - corners
    here, there = edges[:3], -edges[3:]
    lengths = np.linalg.norm(here, axis=1), np.linalg.norm(there, axis=1)
    cosines = (here * there).sum(axis=1) / (lengths[0] * lengths[1])
    unequal = np.abs(lengths[0] - lengths[1]) / (0.5 * (lengths[0] + lengths[1]))
    if cosines.min() < np.cos(np.radians(MOST_TURN_DEG)) or unequal.max() > MOST_UNEQUAL:
        return None
    x, y = (0.5 * (here + there)).T
    try:
        squares = np.linalg.solve(np.array([x * x, x * y, y * y]), np.array([1.0, 0.0, 1.0]))
    except np.linalg.LinAlgError:
        return None
    if squares.min() <= 0:
        return None
    sides = 1 / np.sqrt(squares)
    upright = int(np.argmax(np.abs(y) / np.hypot(x, y)))
    width, depth = np.delete(sides, upright)
    return float(width), float(depth), float(sides[upright])
