"""The floor of a vessel's cavity: how far an object may be lowered near its axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import ConvexHull

from manitwin.geometry.cavity import Opening
from manitwin.geometry.frames.feature import rotation_of

AZIMUTHS = 8


def floor_below_rim(hulls: Sequence[np.ndarray], opening: Opening, radius_m: float) -> float:
    """Return the height (m, negative) relative to the rim's centre of the highest floor within a radius of the vessel's axis."""
    basis = rotation_of(opening.axis)
    angles = np.arange(AZIMUTHS) * 2 * np.pi / AZIMUTHS
    ring = radius_m * np.column_stack([np.cos(angles), np.sin(angles)])
    starts = opening.center_m + np.vstack([ring, ring / 2, np.zeros((1, 2))]) @ basis[:, :2].T
    highest = -opening.depth_m
    for hull in hulls:
        planes = ConvexHull(hull).equations
        slope, offset = planes[:, :3] @ opening.axis, starts @ planes[:, :3].T + planes[:, 3]
        with np.errstate(divide="ignore"):
            at = -offset / slope
        top = np.where(slope > 1e-9, at, np.inf).min(1)
        bottom = np.where(slope < -1e-9, at, -np.inf).max(1)
        beside = (np.abs(slope) <= 1e-9) & (offset > 0)
        met = (bottom < top) & ~beside.any(1) & (top < 0)
        highest = max(highest, float(top[met].max(initial=-np.inf)))
    return highest
