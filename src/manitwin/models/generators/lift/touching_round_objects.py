"""Detection of several round objects that touch or occlude each other, by a silhouette with a waist between two bulges."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from scipy import ndimage

from manitwin.errors import Rejected
from manitwin.models.annotators.prior_names import find_prior

SIDE_PX, LEVELS = 200, 60
MOST_WAIST_RATIO = 0.85
"""Maximum ratio of a waist to the half width of the smaller bulge; a single object is wider between its bulges.

Of 400 views of ten fruit templates and 27 photos of single fruit none has a narrower waist; of ten photos of several that
partly occlude each other six do.
"""
LEAST_BULGE_SHARE = 0.7
"""Minimum half width of a bulge over the largest one; stems, leaf crowns and the neck of a squash are narrower."""
BUNCHES = frozenset({"grape", "cherry"})
"""Names that may mean several objects that hang together."""
LEAST_LIKELY = 0.5
"""Minimum probability of round food and balls for an unnamed object."""


def count_bulges(mask: np.ndarray) -> int:
    """Return the number of bulges of ``mask (H, W) bool`` about as wide as the widest, with waists between; at least 1."""
    scale = SIDE_PX / max(mask.shape)
    small = cv2.resize(mask.astype(np.uint8), None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    filled = np.pad(ndimage.binary_fill_holes(small), 2).astype(np.uint8)
    half_px = cv2.distanceTransform(filled, cv2.DIST_L2, cv2.DIST_MASK_5)
    widest = float(half_px.max())
    most = 1
    for level in np.linspace(0, widest, LEVELS, endpoint=False)[1:]:
        labels, count = ndimage.label(half_px >= level)
        if count > 1:
            peaks = ndimage.maximum(half_px, labels, range(1, count + 1))
            most = max(
                most, int((np.asarray(peaks) >= max(level / MOST_WAIST_RATIO, LEAST_BULGE_SHARE * widest)).sum())
            )
    return most


def reject_several_round(mask: np.ndarray, name: str | None, likely: Sequence[tuple[str, float]] = ()) -> None:
    """Raise Rejected (``several_objects``) if ``mask (H, W) bool`` shows several objects of a ``name``.

    Only names of round food or balls are tested. An unnamed object is tested if most of the probability of its ``likely``
    names (name, probability) is on such names.
    """
    prior = find_prior(name)
    is_round = _is_round(name) if name is not None else sum(p for each, p in likely if _is_round(each)) >= LEAST_LIKELY
    if not is_round or (count := count_bulges(mask)) == 1:
        return
    one, remedy = ("round thing", ", or say what it is with --name") if prior is None else (prior.category, "")
    raise Rejected(
        "several_objects",
        f"its outline has {count} bellies with a waist between, as several have that touch or hide one another, or one with its"
        f" mirror image, and one {one} has not; crop the photo to one of them{remedy}",
        "generate",
    )


def _is_round(name: str) -> bool:
    prior = find_prior(name)
    return (
        prior is not None
        and prior.domain in ("food", "toys")
        and prior.shape == "round"
        and prior.category not in BUNCHES
    )
