"""The object frame: right-handed, +Z up, origin at the bottom centre, the input's yaw kept."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.poses import transform


def object_frame(vertices: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Return the transform ``(4, 4)`` of a mesh's frame into the object frame.

    ``rotation (3, 3)`` turns it upright; the translation puts the lowest of ``vertices (V, 3)`` on z = 0 and the middle
    of the axis-aligned box on x = y = 0.
    """
    turned = vertices @ rotation.T
    low, high = turned.min(0), turned.max(0)
    return transform(rotation, np.array([-(low[0] + high[0]) / 2, -(low[1] + high[1]) / 2, -low[2]]))
