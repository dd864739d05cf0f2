"""Polygons of any size, cut into triangles."""

from __future__ import annotations

import numpy as np


def triangle_fans(sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut polygons of ``sizes (P,)`` corners, listed one after another, into fans about their first corner.

    Returns the corners' places in that list ``(F, 3)`` and the polygon of every triangle ``(F,)``; polygons of
    fewer than three corners give none.
    """
    inner = np.maximum(sizes - 2, 0)
    owner = np.repeat(np.arange(len(sizes)), inner)
    start = (np.cumsum(sizes) - sizes)[owner]
    step = np.arange(len(owner)) - (np.cumsum(inner) - inner)[owner]
    return np.stack([start, start + step + 1, start + step + 2], axis=1), owner
