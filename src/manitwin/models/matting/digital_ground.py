"""What a network says of a ground of one digital colour, onto which somebody laid what was cut out of a photo.

Networks learn from photographed grounds, and are unsure of one without any grain, most of all of black: they see a haze of object
all over it. The frame of such a picture is ground, so that what a network says there is how unsure it is of that ground.
"""

from __future__ import annotations

import cv2
import numpy as np

LIKE_GROUND = 4.0
"""Levels from the ground's digital colour within which a pixel has it: JPEG's own noise beside an outline is off by more."""
FRAME = 0.02
"""Of the longer side: as wide is the frame that is known for ground."""
USUAL = 95.0
"""Percentile of what a network says of the frame's ground: what reaches beyond is a thing that nearly touches it."""
MOST_HAZE = 0.3
"""Share of object: a network that is surer of the frame sees something there."""


def without_haze(share: np.ndarray, rgb: np.ndarray, colour: np.ndarray) -> np.ndarray:
    """Return a network's share of object (h, w) without what it says of all of an exact ground alike.

    ``rgb (H, W, 3) uint8`` is the picture, of the same proportions, ``colour (3,)`` that of its ground. Where the picture has
    that colour, the share that is usual of the frame is taken off; what is said of a place by itself, such as a dark part of a
    thing on black, stays a doubt. Elsewhere the share is as it was.
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
