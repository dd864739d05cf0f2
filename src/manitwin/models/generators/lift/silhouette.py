"""Measurements of a silhouette: symmetry, fill, corners, elongation.

Pixels are (row, column) of a crop around the object; angles are in degrees, positive if the axis leans clockwise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

CROP_SIDE_PX = 384
_SEARCH_SIDE_PX = 192
_ELLIPSE_BITS = 4  # fractional bits of pixel coordinates


@dataclass(frozen=True)
class Silhouette:
    """An object's mask (H, W) with a margin, longer side about 384 px, and its measurements.

    - ``axis_tilt_deg``, ``axis_column_px``: the best mirror axis, of the mask rotated by ``-axis_tilt_deg`` about its centre
    - ``mirror_iou``: overlap of the mirrored halves
    - ``row_fill``: filled share of the rows across the axis
    - ``solidity``: area over that of the convex hull
    - ``rectangle_iou``: overlap with the minimum-area rectangle ``corners`` (4, 2) (x, y)
    - ``ellipse_iou``: overlap with the ellipse of the same moments
    - ``elongation``: length over width
    - ``typical_radius_px``: median radius along the medial axis; ``largest_radius_px``: maximum
    - ``holes``: number of holes above 0.2 % of the area
    """

    mask: np.ndarray
    axis_tilt_deg: float
    axis_column_px: float
    mirror_iou: float
    row_fill: float
    solidity: float
    rectangle_iou: float
    ellipse_iou: float
    corners: np.ndarray
    elongation: float
    typical_radius_px: float
    largest_radius_px: float
    holes: int

    def scores(self) -> dict[str, float]:
        """Return the measurements that decide on the primitive, rounded."""
        names = ("mirror_iou", "row_fill", "solidity", "rectangle_iou", "ellipse_iou", "elongation", "axis_tilt_deg")
        return {name: round(float(getattr(self, name)), 3) for name in names} | {"holes": float(self.holes)}


def analyse_silhouette(mask: np.ndarray) -> Silhouette:
    """Measure a mask (H, W) bool of one connected object with a margin of at least two pixels."""
    contours, hierarchy = cv2.findContours(mask.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    outer = max(contours, key=cv2.contourArea)
    hull_area = cv2.contourArea(cv2.convexHull(outer))
    holes = [
        c for c, h in zip(contours, hierarchy[0], strict=True) if h[3] >= 0 and cv2.contourArea(c) > 0.002 * mask.sum()
    ]
    rectangle = cv2.boxPoints(cv2.minAreaRect(outer))
    sides = np.linalg.norm(rectangle - np.roll(rectangle, 1, axis=0), axis=1)
    filled = np.zeros(mask.shape, np.uint8)
    cv2.fillConvexPoly(filled, np.round(rectangle).astype(np.int32), 1)
    long_tilt, elongation = _principal_axis(mask)
    tilt, iou = _mirror_axis(mask, long_tilt)
    turned = rotate_upright(mask, tilt)
    column, _ = _best_column(turned)
    radius = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5)
    ridge = mask & (radius >= cv2.dilate(radius, np.ones((3, 3), np.uint8)) - 1e-3) & (radius > 1.5)
    return Silhouette(
        mask=mask,
        axis_tilt_deg=tilt,
        axis_column_px=column,
        mirror_iou=iou,
        row_fill=_row_fill(turned),
        solidity=float(mask.sum() / max(hull_area, 1.0)),
        rectangle_iou=float((filled.astype(bool) & mask).sum() / (filled.astype(bool) | mask).sum()),
        ellipse_iou=_ellipse_iou(mask),
        corners=rectangle,
        elongation=max(elongation, float(sides.max() / max(sides.min(), 1.0))),
        typical_radius_px=float(np.median(radius[ridge])) if ridge.any() else float(radius.max()),
        largest_radius_px=float(radius.max()),
        holes=len(holes),
    )


def about_perpendicular_axis(silhouette: Silhouette) -> Silhouette:
    """Return the measurements about the mirror axis perpendicular to the one found."""
    mask = silhouette.mask
    long_tilt, _ = _principal_axis(mask)
    across = abs((silhouette.axis_tilt_deg - long_tilt + 90.0) % 180.0 - 90.0) > 45.0
    tilt, iou = _refined_axis(mask, _downscale(mask), long_tilt if across else long_tilt + 90.0)
    turned = rotate_upright(mask, tilt)
    column, _ = _best_column(turned)
    return replace(silhouette, axis_tilt_deg=tilt, axis_column_px=column, mirror_iou=iou, row_fill=_row_fill(turned))


def rotate_upright(image: np.ndarray, tilt_deg: float) -> np.ndarray:
    """Rotate an image or mask by ``-tilt_deg`` about its centre into a square that contains all of it."""
    height, width = image.shape[:2]
    matrix = upright_transform(height, width, tilt_deg)
    side = upright_side(height, width)
    values = image.astype(np.float32) if image.dtype == bool else image
    turned = cv2.warpAffine(values, matrix, (side, side), flags=cv2.INTER_LINEAR)
    return turned > 0.5 if image.dtype == bool else turned


def upright_side(height: int, width: int) -> int:
    """Return the side of the square made by ``turned_upright``."""
    return int(np.ceil(np.hypot(height, width))) + 4


def upright_transform(height: int, width: int, tilt_deg: float) -> np.ndarray:
    """Return the affine map (2, 3) from pixels (x, y) of the crop to those of the upright square."""
    side = upright_side(height, width)
    matrix = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), tilt_deg, 1.0)
    shift = np.zeros((2, 3))
    shift[:, 2] = (side - width) / 2, (side - height) / 2
    return np.asarray(matrix) + shift


def _principal_axis(mask: np.ndarray) -> tuple[float, float]:
    rows, columns = np.nonzero(mask)
    points = np.column_stack([columns, -rows]).astype(float)
    values, vectors = np.linalg.eigh(np.cov(points.T))
    x, y = vectors[:, 1]
    if y < 0:
        x, y = -x, -y
    return float(np.degrees(np.arctan2(x, y))), float(np.sqrt(values[1] / max(values[0], 1e-9)))


def _ellipse_iou(mask: np.ndarray) -> float:
    """Return the overlap with the filled ellipse that has the mask's centroid and second moments."""
    places = np.stack(np.nonzero(mask)[::-1]).astype(float)
    values, vectors = np.linalg.eigh(np.cov(places))
    x, y = vectors[:, 1]
    half = 2 * np.sqrt(np.maximum(values, 0))
    drawn = np.zeros(mask.shape, np.uint8)
    middle, axes = (np.rint(each * 2**_ELLIPSE_BITS).astype(int).tolist() for each in (places.mean(axis=1), half[::-1]))
    cv2.ellipse(drawn, middle, axes, float(np.degrees(np.arctan2(y, x))), 0, 360, 1, -1, shift=_ELLIPSE_BITS)
    return float((mask & (drawn > 0)).sum() / (mask | (drawn > 0)).sum())


def _mirror_axis(mask: np.ndarray, long_tilt: float) -> tuple[float, float]:
    """Find the tilt with the best mirror symmetry: upright, along or across the principal axis, then refined."""
    small = _downscale(mask)

    def agreement(tilt: float) -> float:
        return _best_column(rotate_upright(small, tilt))[1]

    # the upright axis is preferred unless others are clearly better, because most photos show upright objects
    starts = {0.0: 0.012, long_tilt: 0.0, long_tilt + 90.0: -0.02}
    return _refined_axis(mask, small, max(starts, key=lambda tilt: agreement(tilt) + starts[tilt]))


def _refined_axis(mask: np.ndarray, small: np.ndarray, best: float) -> tuple[float, float]:
    """Return the tilt near ``best`` with the best mirror symmetry, first at low and then at full resolution, and its overlap."""

    def agreement(tilt: float) -> float:
        return _best_column(rotate_upright(small, tilt))[1]

    tilt = best
    for step in (4.0, 2.0, 1.0, 0.5):
        tilt = max((tilt - step, tilt, tilt + step), key=lambda t: (agreement(t), -abs(t - best)))
    if agreement(tilt) < agreement(best) + 0.004:
        tilt = best
    exact = {t: _best_column(rotate_upright(mask, t))[1] for t in (tilt - 0.25, tilt, tilt + 0.25)}
    tilt = max(exact, key=lambda t: (exact[t], -abs(t - tilt)))
    return (tilt + 90.0) % 180.0 - 90.0, exact[tilt]


def _downscale(mask: np.ndarray) -> np.ndarray:
    scale = _SEARCH_SIDE_PX / max(mask.shape)
    small = cv2.resize(mask.astype(np.float32), None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return np.asarray(small > 0.5)


def _best_column(turned: np.ndarray) -> tuple[float, float]:
    """Return the column about which an upright mask is most symmetric, and the overlap of its halves (IoU)."""
    rows = turned.any(axis=1)
    if not rows.any():
        return turned.shape[1] / 2, 0.0
    filled = turned[rows]
    left = filled.argmax(axis=1)
    right = turned.shape[1] - 1 - filled[:, ::-1].argmax(axis=1)
    centre = float(np.median((left + right) / 2))
    columns = np.arange(turned.shape[1])
    best = (centre, 0.0)
    for candidate in np.round(2 * (centre + np.arange(-4, 4.5, 0.5))) / 2:
        mirrored = np.round(2 * candidate - columns).astype(int)
        inside = (mirrored >= 0) & (mirrored < turned.shape[1])
        mirror = np.zeros_like(filled)
        mirror[:, columns[inside]] = filled[:, mirrored[inside]]
        overlap = float((filled & mirror).sum() / (filled | mirror).sum())
        if overlap > best[1]:
            best = (float(candidate), overlap)
    return best


def _row_fill(turned: np.ndarray) -> float:
    rows = turned[turned.any(axis=1)]
    left = rows.argmax(axis=1)
    right = rows.shape[1] - rows[:, ::-1].argmax(axis=1)
    return float(rows.sum() / (right - left).sum())
