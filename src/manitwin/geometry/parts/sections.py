"""Part rules for elongated objects: head, neck and handle, or a shaft with distinct ends."""

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

_NECK_NARROW = 0.8  # fraction of the handle's width and thickness (geometric mean): largest value for a neck
LEAST_CONTRAST = 1.2  # ratio of width and thickness across a border


def ended(shape: Shape, points_m: np.ndarray) -> Membership | None:
    """Head and handle, with a narrower neck between them if there is one, as sections of the long axis.

    The borders are the one or two least-squares change points of width and thickness of the outline.
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
    """Return the positions of the surface samples along the long axis ``(N,)``, and across it ``(N, 2)`` m."""
    return shape.axis.along(shape.surface_m), (shape.surface_m - shape.axis.origin_m) @ shape.axis.across.T


_SECTION_BAND = 0.05  # fraction of the longest side: these borders are known more precisely than that of a handle


def sectioned(shape: Shape, points_m: np.ndarray) -> Membership | None:
    """Shaft, and distinct sections at the tip, the end or both; the larger of two sections is the shaft."""
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
