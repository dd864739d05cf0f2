"""Refinement of an outline that a user drew roughly: it is moved onto nearby edges of the photo."""

from __future__ import annotations

import math

import cv2
import numpy as np

from manitwin.models.matting.outline import dilated, eroded

WORKING_SIDE_PX = 640
BAND_SHARE, LEAST_BAND_PX = 0.03, 4
"""Maximum displacement of the outline, as a share of the diagonal of the mask's bounding box, and its lower bound in pixels."""
NEAR_BANDS = 4
"""Width, in bands, of the background around the object that is used; pixels farther away are not representative of it."""
ITERATIONS = 4


def fit_outline(rgb: np.ndarray, mask: np.ndarray, *, seed: int = 0) -> np.ndarray:
    """Return ``mask (H, W) bool`` with its outline on edges of ``rgb (H, W, 3) uint8``: GrabCut (Rother et al. 2004) in a band.

    Pixels deeper inside the mask than the band's width are fixed as object, pixels farther outside as background. A mask that
    is empty or has no background around it is returned unchanged.
    """
    if not mask.any():
        return mask
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    band_px = BAND_SHARE * math.hypot(np.ptp(rows) + 1, np.ptp(columns) + 1)
    margin_px = math.ceil(NEAR_BANDS * max(LEAST_BAND_PX, band_px))
    near = np.s_[
        max(0, rows[0] - margin_px) : rows[-1] + margin_px + 1,
        max(0, columns[0] - margin_px) : columns[-1] + margin_px + 1,
    ]
    height, width = mask[near].shape
    scale = min(1.0, WORKING_SIDE_PX / max(height, width))
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    rough = cv2.resize(mask[near].astype(np.uint8), size, interpolation=cv2.INTER_NEAREST).astype(bool)
    band = max(LEAST_BAND_PX, round(scale * band_px))
    labels = np.where(rough, cv2.GC_PR_FGD, cv2.GC_PR_BGD).astype(np.uint8)
    labels[eroded(rough, band)], labels[~dilated(rough, band)] = cv2.GC_FGD, cv2.GC_BGD
    if not rough.any() or not (labels == cv2.GC_BGD).any():
        return mask
    cv2.setRNGSeed(seed)
    cv2.grabCut(
        cv2.resize(rgb[near], size, interpolation=cv2.INTER_AREA),
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
    fitted = np.zeros(mask.shape, bool)
    fitted[near] = cv2.resize(found, (width, height), interpolation=cv2.INTER_LINEAR) > 0.5
    return fitted
