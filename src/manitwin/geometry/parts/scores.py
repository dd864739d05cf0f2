"""Helpers of feature scores: falloff with distance, and relative height."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.parts.shape import Shape, SurfacePoints


def gaussian_falloff(distance: np.ndarray, width: float) -> np.ndarray:
    """Return exp(-(distance / width)^2 / 2): 1 at distance 0, 0.6 at ``width``, 0.01 at three times ``width``."""
    return np.exp(-0.5 * (distance / max(width, 1e-9)) ** 2)


def relative_height(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """Return the heights of points ``(N,)`` as shares of the object's height."""
    low, high = shape.bounds_m[:, 2]
    return (points.positions_m[:, 2] - low) / max(high - low, 1e-9)
