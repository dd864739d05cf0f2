"""Bounding boxes in images, in pixels: left, top, right, bottom; x to the right and y down from the top left corner."""

from __future__ import annotations

import numpy as np

PixelBox = tuple[float, float, float, float]
"""Left, top, right, bottom."""


def box_of_pixels(mask: np.ndarray) -> PixelBox:
    """Return the bounding box of a non-empty mask ``(H, W) bool``."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1)


def intersection_over_union(one: PixelBox, other: PixelBox) -> float:
    """Return the intersection over union of two boxes, 0..1."""
    width = min(one[2], other[2]) - max(one[0], other[0])
    height = min(one[3], other[3]) - max(one[1], other[1])
    both = max(width, 0.0) * max(height, 0.0)
    areas = [(box[2] - box[0]) * (box[3] - box[1]) for box in (one, other)]
    return both / (sum(areas) - both)


def crop_to_image_box(box: PixelBox, window: PixelBox, scale: tuple[float, float]) -> PixelBox:
    """Convert a box from a crop (``window``, enlarged by ``scale`` (x, y)) to pixels of the whole image."""
    left, top = window[:2]
    return left + box[0] / scale[0], top + box[1] / scale[1], left + box[2] / scale[0], top + box[3] / scale[1]


def image_to_crop_box(box: PixelBox, window: PixelBox, scale: float) -> PixelBox:
    """Convert a box from pixels of the whole image to those of a crop (``window``, enlarged by ``scale``)."""
    left, top = window[:2]
    return scale * (box[0] - left), scale * (box[1] - top), scale * (box[2] - left), scale * (box[3] - top)
