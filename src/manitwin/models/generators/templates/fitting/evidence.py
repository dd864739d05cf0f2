"""Image evidence of a matted photo: mask, signed distance to the silhouette contour, inner edges and colours."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

SIDE_PX = 112
OVERSAMPLING = 2
"""Oversampling of silhouettes relative to colours, so that the fit resolves differences of less than a pixel."""
BOX_SHARE = 0.82
"""Share of the image that the object's box fills; the margin shows a solid that is larger than the photo's object."""
REACH = 0.06
"""Truncation of the signed distance, as a share of the image side."""
LARGEST_PERFORATION = 0.008
"""Maximum area of an ignored hole of a perforated object, as a share of the mask; larger holes, as in a handle, are compared."""
_RIM_PX = 3  # excludes the gradient of the contour itself
_EDGE_LAB = 14.0  # smoothed gradient in Lab units per pixel that counts as half an edge
_DIAGONAL_35MM = 43.27
TYPICAL_FOCAL_MM, FOCAL_SPREAD = 36.0, 0.45
"""Typical focal length of phones and cameras (35 mm equivalent), and the standard deviation of its logarithm: 26 to 80 mm are
usual.
"""
KNOWN_FOCAL_SPREAD = 0.2
"""The same for a known lens: the uncertainty of the ratio 1.6 between box size and half diagonal."""


@dataclass(frozen=True)
class Evidence:
    """A photo's object in a square image of side ``SIDE_PX``.

    - ``mask (S, S) bool``; ``outline`` is the truncated signed distance to its contour in -1..1, positive inside.
    - ``filled_mask`` and ``filled_outline``: the same without small holes, for perforated objects.
    - ``edge (S, S)``: strength of inner edges at or next to each pixel, 0..1.
    - ``lab (S, S, 3) float32``: colours; ``inner (S, S) bool``: pixels well inside the mask.
    - ``perspective``: object size over distance for the known or a usual lens; ``focal_spread``: standard deviation of its
      logarithm.
    - ``center_px`` and ``box_px``: centre (x, y) and longer side of the object's box in the photo.
    """

    mask: np.ndarray
    outline: np.ndarray
    filled_mask: np.ndarray
    filled_outline: np.ndarray
    edge: np.ndarray
    lab: np.ndarray
    inner: np.ndarray
    perspective: float
    focal_spread: float
    center_px: tuple[float, float]
    box_px: float

    def for_comparison(self, *, perforated: bool) -> Evidence:
        """Return the evidence to compare a solid with; a perforated solid is drawn without small holes, so they are filled here
        too.
        """
        return replace(self, mask=self.filled_mask, outline=self.filled_outline) if perforated else self


def extract_evidence(rgba: np.ndarray, focal_mm: float | None = None) -> Evidence:
    """Return the evidence of ``rgba (H, W, 4) uint8`` with the object's mask as alpha; ``focal_mm`` is 35 mm equivalent, if
    known.
    """
    solid = rgba[..., 3] > 127
    rows, columns = np.nonzero(solid.any(axis=1))[0], np.nonzero(solid.any(axis=0))[0]
    height, width = float(rows[-1] - rows[0] + 1), float(columns[-1] - columns[0] + 1)
    center = ((columns[0] + columns[-1]) / 2, (rows[0] + rows[-1]) / 2)
    box_px = max(height, width)
    fine = _crop(rgba, center, box_px, OVERSAMPLING * SIDE_PX)
    small = np.asarray(cv2.resize(fine, (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_AREA))
    whole, mask = _largest(fine[..., 3] > 127.5), _largest(small[..., 3] > 127.5)
    lab = np.asarray(cv2.cvtColor(np.ascontiguousarray(small[..., :3] / 255), cv2.COLOR_RGB2Lab))
    depth = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5)
    focal_px = (focal_mm or TYPICAL_FOCAL_MM) / _DIAGONAL_35MM * float(np.hypot(*rgba.shape[:2]))
    outline, filled = signed_distance(whole), fill_small_holes(whole)
    return Evidence(
        mask=mask,
        outline=outline,
        filled_mask=fill_small_holes(mask),
        filled_outline=outline if filled is whole else signed_distance(filled),
        edge=_edges(lab, depth > _RIM_PX),
        lab=lab,
        inner=depth > _RIM_PX,
        perspective=box_px / focal_px,
        focal_spread=FOCAL_SPREAD if focal_mm is None else KNOWN_FOCAL_SPREAD,
        center_px=center,
        box_px=box_px,
    )


def signed_distance(mask: np.ndarray) -> np.ndarray:
    """Return the truncated signed distance to the contour of an oversampled mask, in -1..1, positive inside, at image resolution.

    It is computed only near the mask's box; pixels farther away are -1.
    """
    step, reach = 2 * OVERSAMPLING, REACH * mask.shape[0]
    found = np.full([len(range(1, side, step)) for side in mask.shape], -1.0, np.float32)
    inside = mask.astype(np.uint8)
    left, top, width, height = cv2.boundingRect(inside)
    if not width:
        return found
    away_px = int(reach) + 2
    # The first row and column are multiples of the step.
    first_row, first_column = (max(0, (first - away_px) // step * step) for first in (top, left))
    inside = np.ascontiguousarray(inside[first_row : top + height + away_px, first_column : left + width + away_px])
    depth, beyond = (cv2.distanceTransform(each, cv2.DIST_L2, 3)[1::step, 1::step] for each in (inside, 1 - inside))
    some = np.clip((depth - beyond) / reach, -1, 1)
    row, column = first_row // step, first_column // step
    found[row : row + some.shape[0], column : column + some.shape[1]] = some
    return found


def fill_small_holes(mask: np.ndarray) -> np.ndarray:
    """Return a mask ``(H, W) bool`` with holes of up to ``LARGEST_PERFORATION`` of its area filled; the mask itself if it has
    none.
    """
    count, labels, stats, _ = cv2.connectedComponentsWithStats((~mask).astype(np.uint8), connectivity=4)
    small = stats[:, cv2.CC_STAT_AREA] <= LARGEST_PERFORATION * mask.sum()
    small[0] = False  # the mask itself
    if count <= 2 or not small.any():
        return mask
    return np.asarray(mask | small[labels])


def _largest(mask: np.ndarray) -> np.ndarray:
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    return mask if count <= 2 else labels == 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))


def _crop(rgba: np.ndarray, center: tuple[float, float], box_px: float, side_px: int) -> np.ndarray:
    """Return the object's square of the photo ``(side, side, 4) float32`` with colours of the object only."""
    half = 0.5 * box_px / BOX_SHARE
    left, top = max(0, int(center[0] - half) - 2), max(0, int(center[1] - half) - 2)
    picture = rgba[top : int(center[1] + half) + 3, left : int(center[0] + half) + 3].astype(np.float32)
    picture[..., :3] *= picture[..., 3:] / 255
    scale = BOX_SHARE * side_px / box_px
    shrunk = min(1.0, 1.5 * scale)  # area averaging first, then interpolation
    if shrunk < 1:
        size = (max(1, round(picture.shape[1] * shrunk)), max(1, round(picture.shape[0] * shrunk)))
        ratio = np.array(size, dtype=float) / np.array(picture.shape[1::-1], dtype=float)
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA))
    else:
        ratio = np.ones(2)
    middle = (np.array(center) - (left, top) + 0.5) * ratio - 0.5
    step = scale / ratio
    shift = (side_px - 1) / 2 - step * middle
    move = np.array([[step[0], 0, shift[0]], [0, step[1], shift[1]]])
    small = np.asarray(cv2.warpAffine(picture, move, (side_px, side_px), flags=cv2.INTER_LINEAR))
    small[..., :3] = small[..., :3] / (np.maximum(small[..., 3:], 1) / 255)
    return np.clip(small, 0, 255)


def _edges(lab: np.ndarray, inner: np.ndarray) -> np.ndarray:
    smooth = cv2.GaussianBlur(lab, (0, 0), 1.0)
    gradient = np.zeros(lab.shape[:2], np.float32)
    for channel in range(3):
        x = cv2.Sobel(smooth[..., channel], cv2.CV_32F, 1, 0) / 4
        y = cv2.Sobel(smooth[..., channel], cv2.CV_32F, 0, 1) / 4
        gradient = np.maximum(gradient, np.hypot(x, y))
    strength = np.where(inner, gradient / (gradient + _EDGE_LAB / 4), 0).astype(np.float32)
    return np.asarray(cv2.GaussianBlur(cv2.dilate(strength, np.ones((3, 3), np.uint8)), (0, 0), 1.0))
