"""Correction of a network's output on a background of one digital colour, onto which an object was pasted.

Networks are trained on photographed backgrounds and are uncertain about one without grain, most of all about black: they
return a haze of low foreground probability all over it. The frame of such a picture is background, so the output there
measures the haze.
"""

from __future__ import annotations

import cv2
import numpy as np

LIKE_GROUND = 4.0
"""Maximum deviation in 8-bit levels from the background colour; JPEG noise beside an outline exceeds it."""
FRAME = 0.02
"""Width of the frame that is known to be background, as a share of the longer side."""
USUAL = 95.0
"""Percentile of the network's output on the frame; higher values belong to an object that nearly touches the frame."""
MOST_HAZE = 0.3
"""Upper bound of the haze; a higher foreground probability on the frame is an actual detection."""


def subtract_haze(share: np.ndarray, rgb: np.ndarray, colour: np.ndarray) -> np.ndarray:
    """Subtract the haze over an exact background from a network's foreground probability (h, w).

    ``rgb (H, W, 3) uint8`` is the picture, of the same proportions, and ``colour (3,)`` that of its background. Where the
    picture has that colour, the usual value on the frame is subtracted; local detections, such as a dark part of an object on
    black, remain. Elsewhere the probability is unchanged.
    """
    seen = cv2.resize(rgb, share.shape[::-1], interpolation=cv2.INTER_AREA).astype(np.float32)
    ground = np.abs(seen - colour.astype(np.float32)).max(axis=2) <= LIKE_GROUND
    width = max(1, round(FRAME * max(share.shape)))
    frame = ground.copy()
    frame[width:-width, width:-width] = False
    if not frame.any():
        return share
    haze = min(float(np.percentile(share[frame], USUAL)), MOST_HAZE)
    return np.asarray(np.where(ground, np.clip((share - haze) / (1 - haze), 0, 1), share), np.float32)
