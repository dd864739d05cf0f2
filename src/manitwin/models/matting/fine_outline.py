"""Refinement of a rough mask's outline at the resolution of the photo."""

from __future__ import annotations

import cv2
import numpy as np

from manitwin.models.matting.outline_network import share_near_outline

BAND_PX = 2
"""Maximum error of the outline, in pixels of the rough mask."""


def fine_outline(rgb: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Refine a mask (any size) to alpha (H, W) uint8 at the size of ``rgb`` (H, W, 3) uint8 (``share_near_outline``)."""
    band = band_px(rgb.shape, mask.shape)
    share = share_near_outline(rgb, mask, band)
    solid = share > 0.5
    for specks, filled in ((_small(~solid, band), 1.0), (_small(solid, band), 0.0)):
        share[specks] = filled
    return np.asarray(np.rint(255 * share), np.uint8)


def band_px(shape: tuple[int, ...], rough_shape: tuple[int, ...]) -> int:
    """Return the maximum error of the outline in pixels of a picture of ``shape`` (H, W, ...), whose mask has ``rough_shape``."""
    return max(BAND_PX, round(BAND_PX * max(shape[:2]) / max(rough_shape)))


def _small(mask: np.ndarray, band: int) -> np.ndarray:
    """Return the pieces of a mask (H, W) smaller than a square of twice the band's width, which are noise along the outline."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    small = stats[:, cv2.CC_STAT_AREA] < (2 * band) ** 2
    small[0] = False
    return np.asarray(small[labels])
