"""Blur width of the edges in a photo: an outline in focus is as narrow as the lens allows, a penumbra is wider."""

from __future__ import annotations

import cv2
import numpy as np

from manitwin.models.matting.outline import disk, gradient_magnitude

FINE_PX, COARSE_PX = 1.0, 2.5
SHARPEST_PX = 0.9  # at working size: minimum width of the edges of a resampled photo
WIDER = 1.25
"""Ratio to the width of the photo's own edges above which an edge is a penumbra.

Widths of a photo's own edges differ by a factor of 1.1; penumbras in synthetic photos are 1.2 to 1.6 times as wide.
"""
LEAST_STEP = 1.5  # L*a*b* per pixel: smaller gradients are JPEG blocks and ringing
LEAST_LENGTH = 0.06  # edge pixels over the longer side: shorter edges are ringing beside a strong edge


def edge_scale(lab: np.ndarray) -> np.ndarray:
    """Return the blur width (H, W) of the edges in ``lab`` (H, W, 3) L*a*b*, as a standard deviation in pixels.

    A step of height D blurred by s0 has the gradient D / sqrt(2 pi (s0^2 + s^2)) under a filter of width s, so the gradients
    at two filter widths give s0 independently of D (local scale from derivatives at several scales: Elder and Zucker 1998).
    Where there is almost no gradient, the width is meaningless.
    """
    fine, coarse = (cv2.dilate(gradient_magnitude(lab, width), disk(1)) for width in (FINE_PX, COARSE_PX))
    squared = np.maximum((fine / np.maximum(coarse, 1e-4)) ** 2, 1 + 1e-3)
    return np.asarray(np.sqrt(np.maximum(COARSE_PX**2 - squared * FINE_PX**2, 0) / (squared - 1)))


def narrow_edges(gradient: np.ndarray, scale_px: np.ndarray, least: float, near: np.ndarray) -> np.ndarray:
    """Return the edges (H, W) steeper than ``least`` L*a*b* per pixel that are about as narrow as the object's strongest ones.

    ``near`` is the mask of the object and its surroundings. Short edges are left out. Narrow edges are in focus: outlines or
    surface markings, but not penumbras, bounced light or a distant background.
    """
    edge = gradient > max(least, LEAST_STEP)
    strong = near & edge
    if strong.any():
        strong &= gradient >= np.percentile(gradient[strong], 50)
    own_px = float(np.median(scale_px[strong])) if strong.any() else SHARPEST_PX
    narrow = edge & (scale_px < WIDER * max(own_px, SHARPEST_PX))
    count, labels = cv2.connectedComponents(cv2.dilate(narrow.astype(np.uint8), disk(1)), connectivity=8)
    long = np.bincount(labels[narrow], minlength=count) > LEAST_LENGTH * max(gradient.shape)
    return np.asarray(narrow & long[labels])
