"""Upsampling of small photos to working size, with chroma sharpened along luma edges."""

from __future__ import annotations

import cv2
import numpy as np

from manitwin.models.matting.guided_filter import guided_filter

GUIDE_PX = 4
EPSILON = 1e-4


def enlarge_photo(rgb: np.ndarray, side_px: int) -> np.ndarray:
    """Scale a photo (H, W, 3) uint8 sRGB up to a longer side of ``side_px``; a larger photo is returned unchanged.

    JPEG stores chroma at half resolution (4:2:0) in blocks of 16 pixels, so in a small photo colours bleed over edges. Before
    enlargement the chroma is therefore filtered along the luma edges.
    """
    scale = side_px / max(rgb.shape[:2])
    if scale <= 1:
        return rgb
    return cv2.resize(sharpen_chroma(rgb), None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)


def sharpen_chroma(rgb: np.ndarray) -> np.ndarray:
    """Return a photo (H, W, 3) uint8 whose chroma channels follow the edges of its luma."""
    channels = cv2.cvtColor(rgb, cv2.COLOR_RGB2YCrCb).astype(np.float32) / 255
    luma = channels[..., 0].copy()
    for channel in (1, 2):
        channels[..., channel] = guided_filter(luma, channels[..., channel].copy(), GUIDE_PX, EPSILON)
    return cv2.cvtColor(np.rint(np.clip(channels, 0, 1) * 255).astype(np.uint8), cv2.COLOR_YCrCb2RGB)
