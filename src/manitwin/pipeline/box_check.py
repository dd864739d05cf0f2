"""Comparison of a photo's cut-out with the stated bounding box of the object, as independent evidence."""

from __future__ import annotations

from dataclasses import replace

from manitwin.geometry.pixel_boxes import PixelBox, box_of_pixels, intersection_over_union
from manitwin.models.matting.matte import DoubtfulMatte, Matte

LEAST_IN_COMMON = 0.8
"""Least intersection over union of the cut-out's box and the stated one; boxes of detectors and annotators are more accurate."""
ELSEWHERE = 0.25
"""Largest confidence of a cut-out that lies elsewhere."""


def require_in_box(matte: Matte, box_px: PixelBox, file: str) -> None:
    """Raise DoubtedCutOut if a matte's bounding box disagrees with the stated box of the object, in pixels of the matte."""
    common = intersection_over_union(box_of_pixels(matte.rgba[..., 3] > 127), box_px)
    if common < LEAST_IN_COMMON:
        raise DoubtfulMatte(
            "low_confidence_matte",
            f"{file}: the cut-out and the stated box overlap by only {100 * common:.0f} %; correct the box, or give"
            f" a mask of the object",
            replace(matte, confidence=min(matte.confidence, ELSEWHERE)),
        )
