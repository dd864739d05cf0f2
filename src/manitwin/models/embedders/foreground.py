"""The thing in a close crop or a photo: its alpha where there is one, else what unlike the border is."""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np

Found = Literal["alpha", "border", "none"]
"""By what the background was told: the picture's transparency, its border, or not at all."""

WORKING_PX = 192
BORDER_PX = 3
ROUNDS = 4
LEAST_SHARE, MOST_SHARE = 0.03, 0.97
"""A thing of less or more of the picture was not told from its background."""
OPAQUE = 250


def foreground(pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray, Found]:
    """Return ``rgb (H, W, 3) uint8`` and a mask ``(H, W) float32`` of the thing in ``pixels (H, W, 3 or 4) uint8``.

    A picture with transparency is taken at its word. Of another one the border is background, and GrabCut tells what else is
    (Rother, Kolmogorov and Blake 2004), at 192 pixels; where that leaves next to nothing, or all, the mask is the whole picture.
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
    cv2.setRNGSeed(0)  # its mixtures begin with k-means at random places
    try:
        models = np.zeros((1, 65)), np.zeros((1, 65))
        cv2.grabCut(np.ascontiguousarray(rgb), marks, (0, 0, 1, 1), *models, ROUNDS, cv2.GC_INIT_WITH_MASK)
    except cv2.error:  # a picture of one colour has no two mixtures
        return rgb, np.ones(rgb.shape[:2], np.float32), "none"
    mask = np.isin(marks, (cv2.GC_FGD, cv2.GC_PR_FGD))
    if not LEAST_SHARE < mask.mean() < MOST_SHARE:
        return rgb, np.ones(rgb.shape[:2], np.float32), "none"
    return rgb, mask.astype(np.float32), "border"
