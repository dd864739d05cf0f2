"""The outline of a rough mask, drawn at a photo's own resolution."""

from __future__ import annotations

import numpy as np

from manitwin.models.matting.outline_network import share_near_outline

BAND_PX = 2
"""How far off the outline may be, in pixels of the rough mask."""


def fine_outline(rgb: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Refine a mask (any size) to alpha (H, W) uint8 at the size of ``rgb`` (H, W, 3) uint8 (``share_near_outline``)."""
    share = share_near_outline(rgb, mask, band_px(rgb.shape, mask.shape))
    return np.asarray(np.rint(255 * share), np.uint8)


def band_px(shape: tuple[int, ...], rough_shape: tuple[int, ...]) -> int:
    """Return how far off an outline may be in a picture of a ``shape`` (H, W, ...), whose mask has a ``rough_shape``."""
    return max(BAND_PX, round(BAND_PX * max(shape[:2]) / max(rough_shape)))
