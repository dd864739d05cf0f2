"""Tell whether what was cut out of a photo lies where the thing is said to be: a stated box is a witness of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manitwin.models.matting.matte import DoubtedCutOut, Matte
from manitwin.pipeline.stated_place import Box

LEAST_IN_COMMON = 0.8
"""Of the cut-out's box and the stated one together: boxes of detectors and of people who label are off by less."""
ELSEWHERE = 0.25
"""How likely a cut-out is right that lies elsewhere, at most."""


def require_in_box(matte: Matte, box_px: Box, file: str) -> None:
    """Raise DoubtedCutOut for a matte that lies elsewhere than the box of the thing, in its pixels, says."""
    common = share_in_common(box_of(matte.rgba[..., 3] > 127), box_px)
    if common < LEAST_IN_COMMON:
        raise DoubtedCutOut(
            "low_confidence_matte",
            f"{file}: what was cut out and the box that was stated of it have {100 * common:.0f} % in common; correct the box, or"
            " give a mask of the thing",
            replace(matte, confidence=min(matte.confidence, ELSEWHERE)),
        )


def box_of(mask: np.ndarray) -> Box:
    """Return the box of what is true of a mask ``(H, W) bool`` that has something."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1)


def share_in_common(one: Box, other: Box) -> float:
    """Return the intersection of two boxes over their union, 0..1."""
    width = min(one[2], other[2]) - max(one[0], other[0])
    height = min(one[3], other[3]) - max(one[1], other[1])
    both = max(width, 0.0) * max(height, 0.0)
    areas = [(box[2] - box[0]) * (box[3] - box[1]) for box in (one, other)]
    return both / (sum(areas) - both)
