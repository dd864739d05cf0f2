"""Boxes of things in pictures: left, top, right and bottom edge in pixels, x to the right, y down, from the picture's corner."""

from __future__ import annotations

import numpy as np

PixelBox = tuple[float, float, float, float]
"""Left, top, right, bottom."""


def box_of_pixels(mask: np.ndarray) -> PixelBox:
    """Return the box of what is true of a mask ``(H, W) bool`` that has something."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1)


def share_in_common(one: PixelBox, other: PixelBox) -> float:
    """Return the intersection of two boxes over their union, 0..1."""
    width = min(one[2], other[2]) - max(one[0], other[0])
    height = min(one[3], other[3]) - max(one[1], other[1])
    both = max(width, 0.0) * max(height, 0.0)
    areas = [(box[2] - box[0]) * (box[3] - box[1]) for box in (one, other)]
    return both / (sum(areas) - both)


def to_picture(box: PixelBox, window: PixelBox, scale: tuple[float, float]) -> PixelBox:
    """Return a box in a picture of a ``window``, drawn ``scale`` (x, y) times as large, in pixels of the whole picture."""
    left, top = window[:2]
    return left + box[0] / scale[0], top + box[1] / scale[1], left + box[2] / scale[0], top + box[3] / scale[1]


def to_window(box: PixelBox, window: PixelBox, scale: float) -> PixelBox:
    """Return a box of the whole picture in pixels of one of a ``window``, drawn ``scale`` times as large."""
    left, top = window[:2]
    return scale * (box[0] - left), scale * (box[1] - top), scale * (box[2] - left), scale * (box[3] - top)
