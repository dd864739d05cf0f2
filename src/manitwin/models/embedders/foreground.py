"""Foreground mask of a close crop or photo: its alpha channel, else a GrabCut segmentation against the border."""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np

Found = Literal["alpha", "border", "none"]
"""Source of the mask: the picture's transparency, its border, or none."""

WORKING_PX = 192
BORDER_PX = 3
ROUNDS = 4
LEAST_SHARE, MOST_SHARE = 0.03, 0.97
"""If the segmented object covers less or more of the picture, the segmentation has failed."""
OPAQUE = 250


def foreground(pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray, Found]:
    """Return ``rgb (H, W, 3) uint8`` and the object mask ``(H, W) float32`` of ``pixels (H, W, 3 or 4) uint8``, and its source.

    The alpha channel is used if a picture has transparency. Otherwise the picture is scaled down to at most 192 pixels, also
    in the result; its border is taken as background, and GrabCut (Rother, Kolmogorov and Blake 2004) segments the object. If
    the mask covers almost nothing or almost everything, it is replaced by the whole picture.
    """
    rgb = pixels[..., :3]
    if pixels.shape[2] == 4 and (pixels[..., 3] < OPAQUE).any():
        alpha = pixels[..., 3].astype(np.float32) / 255
        if (alpha > 0.5).any():
            return rgb, alpha, "alpha"
    scale = WORKING_PX / max(rgb.shape[:2])
    if scale < 1:
        rgb = cv2.resize(rgb, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    marks = np.full(rgb.shape[:2], cv2.GC_PR_FGD, np.uint8)
    marks[:BORDER_PX] = marks[-BORDER_PX:] = marks[:, :BORDER_PX] = marks[:, -BORDER_PX:] = cv2.GC_BGD
    cv2.setRNGSeed(0)  # GrabCut initializes its mixtures by k-means at random
    try:
        models = np.zeros((1, 65)), np.zeros((1, 65))
        cv2.grabCut(np.ascontiguousarray(rgb), marks, (0, 0, 1, 1), *models, ROUNDS, cv2.GC_INIT_WITH_MASK)
    except cv2.error:  # two mixtures cannot be fitted to a picture of one colour
        return rgb, np.ones(rgb.shape[:2], np.float32), "none"
    mask = np.isin(marks, (cv2.GC_FGD, cv2.GC_PR_FGD))
    if not LEAST_SHARE < mask.mean() < MOST_SHARE:
        return rgb, np.ones(rgb.shape[:2], np.float32), "none"
    return rgb, mask.astype(np.float32), "border"
