"""Guided image filter with a grey guide (He, Sun, Tang 2010, eq. 5, 6 and 8)."""

from __future__ import annotations

import cv2
import numpy as np


def guided_filter(guide: np.ndarray, values: np.ndarray, radius_px: int, epsilon: float) -> np.ndarray:
    """Filter ``values (H, W) float32`` as local linear functions of ``guide (H, W) float32`` in windows of ``radius_px``.

    Edges of the guide weaker than the square root of ``epsilon``, in the guide's unit, are smoothed over.
    """
    size = (2 * radius_px + 1, 2 * radius_px + 1)
    mean_guide, mean = cv2.blur(guide, size), cv2.blur(values, size)
    slope = (cv2.blur(guide * values, size) - mean_guide * mean) / (cv2.blur(guide**2, size) - mean_guide**2 + epsilon)
    offset = mean - slope * mean_guide
    return np.asarray(cv2.blur(slope, size) * guide + cv2.blur(offset, size))
