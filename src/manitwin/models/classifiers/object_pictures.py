"""Input pictures of a classifier: the object of a matted picture in a square, on its own background and on plain ones."""

from __future__ import annotations

import cv2
import numpy as np

MARGIN = 0.1
"""Margin around the object, as a share of its longer side."""
PLAIN_GREYS = (127, 255)
"""Plain backgrounds: the mean grey of the network's training data, and white."""


def object_pictures(rgba: np.ndarray, side_px: int) -> np.ndarray:
    """Return the object of ``rgba (H, W, 4) uint8`` in squares ``(3, side_px, side_px, 3) uint8``, centred and upright.

    The first square has the picture's own background, with border pixels repeated; the others have plain backgrounds. The
    background influences a classifier as much as the object does, so its outputs for all squares are averaged. Raises
    ValueError if alpha is empty.
    """
    rows, columns = np.nonzero(rgba[..., 3] > 127)
    if not len(rows):
        raise ValueError("no object: alpha is empty")
    top, left, bottom, right = rows.min(), columns.min(), rows.max() + 1, columns.max() + 1
    half = (0.5 + MARGIN) * max(bottom - top, right - left)
    # only the surroundings of the object are processed, one channel at a time, which saves 80 MB for a large photo
    around = _square(rgba, ((left + right) / 2, (top + bottom) / 2), half)
    alpha = around[..., 3].astype(np.float32) / 255
    free = 1 - _resized(alpha, side_px)
    pictures = np.empty((1 + len(PLAIN_GREYS), side_px, side_px, 3), np.float32)
    for channel in range(3):
        own = around[..., channel].astype(np.float32)
        pictures[0, ..., channel] = _resized(own, side_px)
        own *= alpha
        lit = _resized(own, side_px)
        for place, grey in enumerate(PLAIN_GREYS, start=1):
            pictures[place, ..., channel] = lit + grey * free
    return np.rint(np.clip(pictures, 0, 255)).astype(np.uint8)


def _square(picture: np.ndarray, center: tuple[float, float], half: float) -> np.ndarray:
    """Return the square of ``2 half`` pixels around a centre; border pixels are repeated beyond the border."""
    side, x, y = max(1, round(2 * half)), round(center[0] - half), round(center[1] - half)
    rows, columns = (
        np.clip(np.arange(begin, begin + side), 0, size - 1)
        for begin, size in ((y, picture.shape[0]), (x, picture.shape[1]))
    )
    return picture[rows[:, None], columns]


def _resized(channel: np.ndarray, side_px: int) -> np.ndarray:
    way = cv2.INTER_AREA if len(channel) > side_px else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(channel, (side_px, side_px), interpolation=way))
