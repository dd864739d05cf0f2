"""The soft outline at a photo's own resolution: how much of each pixel is object, from the colours on both sides."""

from __future__ import annotations

import cv2
import numpy as np
from scipy import ndimage

from manitwin.models.matting.background import length
from manitwin.models.matting.outline import soft_outline

BAND_PX = 2.0  # at working size: how far off the outline may be
TELLING_LAB = 8.0  # colours nearer to each other do not tell how they are mixed


def fine_outline(rgb: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Refine a mask (any size) to alpha (H, W) uint8 at the size of ``rgb`` (H, W, 3) uint8.

    In a band around the outline alpha = (I - B) . (F - B) / |F - B|^2, the compositing equation (Porter and Duff 1984) solved for
    alpha, with the colour F of the nearest pixel well inside and the mean colour B just outside. Where both are alike, the
    outline follows the photo's edges (``soft_outline``).
    """
    height, width = rgb.shape[:2]
    scale = max(height, width) / max(mask.shape)
    band = max(2, round(BAND_PX * scale))
    guided = soft_outline(rgb, mask, band)
    rows, columns = np.nonzero(
        cv2.resize(mask.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR) > 0.5
    )
    if not len(rows):
        return guided
    margin = 6 * band + 8
    box = np.s_[
        max(0, rows.min() - margin) : rows.max() + margin + 1,
        max(0, columns.min() - margin) : columns.max() + margin + 1,
    ]
    solid = np.zeros((height, width), bool)
    solid[rows, columns] = True
    alpha = guided.copy()
    alpha[box] = _solved(rgb[box], solid[box], guided[box], band)
    return alpha


def _solved(rgb: np.ndarray, solid: np.ndarray, guided: np.ndarray, band: int) -> np.ndarray:
    depth = cv2.distanceTransform(solid.astype(np.uint8), cv2.DIST_L2, 5)
    away = cv2.distanceTransform((~solid).astype(np.uint8), cv2.DIST_L2, 5)
    reach = 2 * band + 3
    thickest = cv2.dilate(depth, np.ones((reach, reach), np.uint8))
    inner = solid & (depth >= np.minimum(band + 1, 0.7 * thickest))
    outer = ~solid & (away > band + 1) & (away < 4 * band + 6)
    if not inner.any() or not outer.any():
        return guided
    lab = cv2.cvtColor(rgb.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    own, _ = _mean_of(lab, inner, 3)
    nearest = ndimage.distance_transform_edt(~inner, return_distances=False, return_indices=True)
    own = own[nearest[0], nearest[1]]
    beyond, known = _mean_of(lab, outer, 4 * band + 5)
    step = own - beyond
    contrast = length(step)
    offset = cv2.GaussianBlur(lab, (0, 0), 0.5) - beyond
    share = (
        offset[..., 0] * step[..., 0] + offset[..., 1] * step[..., 1] + offset[..., 2] * step[..., 2]
    ) / np.maximum(contrast**2, 1e-6)
    near = (depth <= band + 1) & (away <= band + 1)
    solved = near & known & (contrast > TELLING_LAB)
    alpha = np.where(solved, np.clip(share, 0, 1) * 255, np.where(near, guided, np.where(solid, 255, 0)))
    return np.asarray(np.rint(alpha), np.uint8)


def _mean_of(lab: np.ndarray, used: np.ndarray, side_px: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean colour (H, W, 3) of the ``used`` pixels in a square around each, and where there are any."""
    weight = cv2.blur(used.astype(np.float32), (side_px, side_px))
    total = cv2.blur(lab * used[..., None].astype(np.float32), (side_px, side_px))
    return total / np.maximum(weight, 1e-6)[..., None], weight > 1e-3
