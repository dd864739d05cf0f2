"""Tell whether what was cut out of a photo lies where the thing is said to be: a stated box is a witness of its own."""

from __future__ import annotations

from dataclasses import replace

from manitwin.geometry.pixel_boxes import PixelBox, box_of_pixels, share_in_common
from manitwin.models.matting.matte import DoubtedCutOut, Matte

LEAST_IN_COMMON = 0.8
"""Of the cut-out's box and the stated one together: boxes of detectors and of people who label are off by less."""
ELSEWHERE = 0.25
"""How likely a cut-out is right that lies elsewhere, at most."""


def require_in_box(matte: Matte, box_px: PixelBox, file: str) -> None:
    """Raise DoubtedCutOut for a matte that lies elsewhere than the box of the thing, in its pixels, says."""
    common = share_in_common(box_of_pixels(matte.rgba[..., 3] > 127), box_px)
    if common < LEAST_IN_COMMON:
        raise DoubtedCutOut(
            "low_confidence_matte",
            f"{file}: the cut-out and the stated box overlap by only {100 * common:.0f} %; correct the box, or give"
            f" a mask of the object",
            replace(matte, confidence=min(matte.confidence, ELSEWHERE)),
        )
