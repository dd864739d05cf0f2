"""An outline that a person drew roughly, moved onto the edges of the photo near it."""

from __future__ import annotations

import math

import cv2
import numpy as np

from manitwin.models.matting.outline import dilated, eroded

WORKING_SIDE_PX = 640
BAND_SHARE, LEAST_BAND_PX = 0.04, 4
"""How far an outline moves at most: this share of the thing's diagonal in the picture, or so many pixels."""
ITERATIONS = 4


def fit_outline(rgb: np.ndarray, mask: np.ndarray, *, seed: int = 0) -> np.ndarray:
    """Return ``mask (H, W) bool`` with its outline on edges of ``rgb (H, W, 3) uint8``: GrabCut (Rother et al. 2004) in a band.

    What lies deeper within the mask than the band is wide is the thing, what lies farther outside is none. A mask that is empty
    or has no ground around it is returned as it is.
    """
    if not mask.any() or mask.all():
        return mask
    height, width = mask.shape
    scale = min(1.0, WORKING_SIDE_PX / max(height, width))
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    small = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)
    rough = cv2.resize(mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST).astype(bool)
    rows, columns = np.flatnonzero(rough.any(axis=1)), np.flatnonzero(rough.any(axis=0))
    if not len(rows):
        return mask
    band_px = max(LEAST_BAND_PX, round(BAND_SHARE * math.hypot(np.ptp(rows) + 1, np.ptp(columns) + 1)))
    core, reach = eroded(rough, band_px), dilated(rough, band_px)
    labels = np.where(rough, cv2.GC_PR_FGD, cv2.GC_PR_BGD).astype(np.uint8)
    labels[core], labels[~reach] = cv2.GC_FGD, cv2.GC_BGD
    if reach.all() or not (labels == cv2.GC_BGD).any():
        return mask
    cv2.setRNGSeed(seed)
    cv2.grabCut(
        np.ascontiguousarray(small),
        labels,
        (0, 0, 1, 1),
        np.zeros((1, 65)),
        np.zeros((1, 65)),
        ITERATIONS,
        cv2.GC_INIT_WITH_MASK,
    )
    found = ((labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD)).astype(np.float32)
    if not found.any():
        return mask
    return np.asarray(cv2.resize(found, (width, height), interpolation=cv2.INTER_LINEAR) > 0.5)
