"""How wide the edges of a photo are blurred: an outline in focus is as narrow as the lens makes it, a penumbra is wider."""

from __future__ import annotations

import cv2
import numpy as np

from manitwin.models.matting.outline import disk, gradient_magnitude

FINE_PX, COARSE_PX = 1.0, 2.5
SHARPEST_PX = 0.9  # at working size: a resampled photo's own edges are at least about as wide
WIDER = 1.25
"""Times the width of the photo's own edges, from which on an edge is a penumbra: a photo's own differ by 1.1 times, penumbras of
made photos are 1.2 to 1.6 times as wide."""
LEAST_STEP = 1.5  # L*a*b* per pixel: less is a JPEG's blocks and ringing
LEAST_LENGTH = 0.06  # pixels of an edge against the longer side: shorter ones are ringing beside a strong edge


def edge_scale(lab: np.ndarray) -> np.ndarray:
    """Return the width (H, W) of the blur of the edges in ``lab`` (H, W, 3) L*a*b*, a standard deviation in pixels.

    A step blurred by s0 has the gradient D / sqrt(2 pi (s0^2 + s^2)) under a filter of width s, so its gradients at two widths
    give s0 whatever its height D (local scale by derivatives at several scales: Elder and Zucker 1998). Between edges, where
    there is next to no gradient, the width means nothing.
    """
    fine, coarse = (cv2.dilate(gradient_magnitude(lab, width), disk(1)) for width in (FINE_PX, COARSE_PX))
    squared = np.maximum((fine / np.maximum(coarse, 1e-4)) ** 2, 1 + 1e-3)
    return np.asarray(np.sqrt(np.maximum(COARSE_PX**2 - squared * FINE_PX**2, 0) / (squared - 1)))


def narrow_edges(gradient: np.ndarray, scale_px: np.ndarray, least: float, near: np.ndarray) -> np.ndarray:
    """Return the edges (H, W) steeper than ``least`` L*a*b* per pixel that are about as narrow as the strongest ``near`` a thing.

    Short pieces are left out. The others are in focus: outlines, or drawing on a surface, but no penumbra, no light that is
    thrown back, and nothing far behind.
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
