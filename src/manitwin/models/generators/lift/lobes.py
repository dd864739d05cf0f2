"""Several round things that touch or hide one another have the outline of none of them: it has a waist between two bellies."""

from __future__ import annotations

import cv2
import numpy as np
from scipy import ndimage

from manitwin.errors import Rejected
from manitwin.models.annotators.prior_names import lookup

SIDE_PX, LEVELS = 200, 60
WAIST = 0.85
"""Of the smaller belly's half width: what is between two of one thing is wider. Of 400 views of ten templates of fruit and of 27
photos of one none has a narrower one; of ten photos of several that hide one another in part six have."""
LEAST_BELLY = 0.7
"""Of the largest one's half width: a stem, a crown of leaves, the neck of a squash are narrower."""
BUNCHES = frozenset({"grape", "cherry"})
"""What is called so may be several that hang together."""


def bellies(mask: np.ndarray) -> int:
    """Return how many places of a mask ``(H, W) bool`` are about as wide as its widest, with waists between; at least 1."""
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
            most = max(most, int((np.asarray(peaks) >= max(level / WAIST, LEAST_BELLY * widest)).sum()))
    return most


def reject_several_round(mask: np.ndarray, name: str | None) -> None:
    """Raise Rejected (``several_objects``) where a mask ``(H, W) bool`` is that of several things of a ``name`` of round food."""
    prior = lookup(name)
    if prior is None or prior.domain != "food" or prior.shape != "round" or prior.category in BUNCHES:
        return
    if (count := bellies(mask)) > 1:
        raise Rejected(
            "several_objects",
            f"its outline has {count} bellies with a waist between, as several have that touch or hide one another, and one"
            f" {prior.category} has not; crop the photo to one of them",
            "generate",
        )
