"""Several round things that touch or hide one another have the outline of none of them: it has a waist between two bellies."""

from __future__ import annotations

from collections.abc import Sequence

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
LEAST_LIKELY = 0.5
"""Of the probability of what nobody has named: that much is of round food and balls."""


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


def reject_several_round(mask: np.ndarray, name: str | None, likely: Sequence[tuple[str, float]] = ()) -> None:
    """Raise Rejected (``several_objects``) where a mask ``(H, W) bool`` is that of several things of a ``name``.

    That is where the name is of round food or balls. What nobody has named is such a thing where most of what it is ``likely``
    called, by name and probability, is.
    """
    prior = lookup(name)
    is_round = _is_round(name) if name is not None else sum(p for each, p in likely if _is_round(each)) >= LEAST_LIKELY
    if not is_round or (count := bellies(mask)) == 1:
        return
    one, remedy = ("round thing", ", or say what it is with --name") if prior is None else (prior.category, "")
    raise Rejected(
        "several_objects",
        f"its outline has {count} bellies with a waist between, as several have that touch or hide one another, or one with its"
        f" mirror image, and one {one} has not; crop the photo to one of them{remedy}",
        "generate",
    )


def _is_round(name: str) -> bool:
    prior = lookup(name)
    return (
        prior is not None
        and prior.domain in ("food", "toys")
        and prior.shape == "round"
        and prior.category not in BUNCHES
    )
