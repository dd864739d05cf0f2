"""What the scores of places have in common: how a score falls with distance, and how high a point is."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.parts.shape import Shape, SurfacePoints


def near(distance: np.ndarray, width: float) -> np.ndarray:
    """Return 1 at distance 0, falling to 0.6 at ``width`` and to nothing at three of them."""
    return np.exp(-0.5 * (distance / max(width, 1e-9)) ** 2)


def share_of_height(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """Return the height of points ``(N,)`` as shares of the object's."""
    low, high = shape.bounds_m[:, 2]
    return (points.positions_m[:, 2] - low) / max(high - low, 1e-9)
