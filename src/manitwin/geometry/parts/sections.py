"""Sections of a long thing: head, neck and handle, or a shaft and what is told from it at its ends."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.parts.membership import Membership
from manitwin.geometry.parts.outline import (
    LEAST_EXPLAINED,
    SLICES,
    THIRD_GAIN,
    best_splits,
    explained_confidence,
    filled_outline,
    slices_along,
)
from manitwin.geometry.parts.section_borders import section_borders
from manitwin.geometry.parts.shape import Shape

_NECK_NARROW = 0.8  # of the handle's width and thickness (geometric mean): a neck is at most that
LEAST_CONTRAST = 1.2  # of width and thickness on both sides of a border


def ended(shape: Shape, points_m: np.ndarray) -> Membership | None:
    """Head and handle, with a narrower neck between them where there is one: stretches of the long axis.

    The borders are where width and thickness change most: one or two change points by least squares over the outline.
    """
    if not shape.has_ends:
        return None
    outline = filled_outline(slices_along(*_samples(shape)), 1e-3 * shape.size_m)
    along = shape.axis.along(points_m)
    one, (split,) = best_splits(outline, 1)
    two, (neck, grip) = best_splits(outline, 2)
    middle, handle = outline[neck:grip].mean(), outline[grip:].mean()
    if two - one >= THIRD_GAIN and two >= LEAST_EXPLAINED and middle <= handle + np.log(_NECK_NARROW):
        index = np.searchsorted(np.array([neck, grip]) / SLICES, along, side="right")
        return Membership(("head", "neck", "handle"), index, explained_confidence(two))
    apart = float(np.linalg.norm(outline[:split].mean(0) - outline[split:].mean(0)))
    if one < LEAST_EXPLAINED or apart < np.log(LEAST_CONTRAST):
        return None
    return Membership(("head", "handle"), (along >= split / SLICES).astype(int), explained_confidence(one))


def _samples(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return where the samples of the surface are along the long axis ``(N,)``, and across it ``(N, 2)`` m."""
    return shape.axis.along(shape.surface_m), (shape.surface_m - shape.axis.origin_m) @ shape.axis.across.T


_SECTION_BAND = 0.05  # of the longest side: these borders are known more exactly than that of a handle


def sectioned(shape: Shape, points_m: np.ndarray) -> Membership | None:
    """Shaft, and what is told from it at the tip, at the end or at both; of two sections the larger is the shaft."""
    if not shape.has_ends:
        return None
    share, across_m = _samples(shape)
    found = section_borders(share, across_m, shape.size_m)
    if found is None:
        return None
    borders, confidence = found
    index = np.searchsorted(np.array(borders) / SLICES, shape.axis.along(points_m), side="right")
    if len(borders) == 2:
        roles = np.array([1, 0, 2])
    else:
        roles = np.array([0, 2] if (share < borders[0] / SLICES).mean() > 0.5 else [1, 0])
    return Membership(("shaft", "tip", "end"), roles[index], confidence, _SECTION_BAND)
