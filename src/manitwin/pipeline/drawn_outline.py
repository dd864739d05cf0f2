"""Outlines of objects drawn by a person on a photo: their storage in amendments, and the cut-outs made from them."""

from __future__ import annotations

import base64
import binascii
import io
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image

from manitwin.errors import Rejected
from manitwin.geometry.pixel_boxes import PixelBox
from manitwin.models.matting.matte import TRANSPARENT_SHARE
from manitwin.pipeline.cutout import SHOWN_PX
from manitwin.pipeline.given_alpha import CutOutInput
from manitwin.pipeline.stated_place import window_of

DRAWN = "outline"
"""Key of the photo stage's amendment ``{png, source}``: the outline as a base64-encoded PNG file, and its author."""
DRAWN_OF_SEVERAL = "outlines"
"""Key for several photos of one object: such amendments by the photo's index, '0' for the first."""
_REMEDY = "remove its file below DATASET/amendments, build again and redraw the outline"
_BOUND = 0.02
"""Tolerated relative difference of the aspect ratios of outline and photo, both of whole pixels."""


@dataclass(frozen=True)
class DrawnOutline:
    """A drawn outline: ``mask (H, W) bool``, at most ``SHOWN_PX`` large, True on the object; ``source`` is its author."""

    mask: np.ndarray
    source: str

    def is_of(self, shape: tuple[int, int]) -> bool:
        """Return whether an image of ``shape`` (rows, columns) has the same aspect ratio."""
        return abs(self.mask.shape[0] * shape[1] / (self.mask.shape[1] * shape[0]) - 1) <= _BOUND

    def scaled(self, shape: tuple[int, int]) -> np.ndarray:
        """Return the mask resampled to an image of ``shape`` (rows, columns): ``(H, W) uint8``."""
        grey = Image.fromarray(np.where(self.mask, 255, 0).astype(np.uint8))
        return np.asarray(grey.resize(shape[::-1], Image.Resampling.BILINEAR))

    def to_json(self) -> dict[str, str]:
        """Return the stored representation."""
        encoded = io.BytesIO()
        Image.fromarray(self.mask).save(encoded, "PNG", optimize=True)
        return {"png": base64.b64encode(encoded.getvalue()).decode("ascii"), "source": self.source}


def drawn_outline(amendment: Mapping[str, Any], name: str, place: int | None = None) -> DrawnOutline | None:
    """Return the outline in the photo stage's amendment; None if there is none.

    ``place`` is the index of the photo if it is one of several of an object. Raises Rejected for a malformed entry, so that the
    photo ``name`` is not cut out in an unintended way.
    """
    try:
        said = amendment.get(DRAWN) if place is None else amendment.get(DRAWN_OF_SEVERAL, {}).get(str(place))
        if said is None:
            return None
        return DrawnOutline(mask_of_png(base64.b64decode(said["png"], validate=True)), str(said["source"]))
    except (AttributeError, KeyError, TypeError, ValueError, binascii.Error) as error:
        raise _refused(f"{name}: its drawn outline cannot be read; {_REMEDY}") from error


def with_outline(amendment: Mapping[str, Any], drawn: DrawnOutline, place: int | None = None) -> dict[str, Any]:
    """Return the photo stage's amendment with an outline, replacing an earlier one of the same photo."""
    if place is None:
        return {**amendment, DRAWN: drawn.to_json()}
    return {**amendment, DRAWN_OF_SEVERAL: {**amendment.get(DRAWN_OF_SEVERAL, {}), str(place): drawn.to_json()}}


def mask_of_png(data: bytes) -> np.ndarray:
    """Return the mask ``(H, W) bool`` of a PNG file, True where it is brighter than half. Raises ValueError for other files."""
    try:
        with Image.open(io.BytesIO(data), formats=("PNG",)) as picture:
            if max(picture.size) > SHOWN_PX:  # checked before decompression
                raise ValueError(f"an outline has at most {SHOWN_PX} pixels a side, not {max(picture.size)}")
            return np.asarray(picture.convert("L")) > 127
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise ValueError("no PNG file") from error


def why_no_outline(mask: np.ndarray) -> str | None:
    """Return why a mask ``(H, W) bool`` cannot be an object's outline, as the end of a sentence; None if it can."""
    if not mask.any():
        return "is empty"
    return "covers the whole photo" if (~mask).mean() <= TRANSPARENT_SHARE else None


def cut_by_outline(given: CutOutInput, drawn: DrawnOutline, name: str) -> CutOutInput:
    """Return an image cut out by a drawn outline, regardless of its own alpha channel.

    Raises Rejected if the outline has another aspect ratio, is empty, or covers the whole image.
    """
    height, width = given.pixels.shape[:2]
    if not drawn.is_of((height, width)):
        raise _refused(f"{name}: {drawn.source} drew the outline on another picture; {_REMEDY}")
    if (why := why_no_outline(drawn.mask)) is not None:
        raise _refused(f"{name}: the outline that {drawn.source} drew {why}; {_REMEDY}")
    alpha = drawn.scaled((height, width))
    return CutOutInput(np.dstack([given.pixels[..., :3], alpha]), (f"cut out as {drawn.source} drew its outline",))


def mask_file(drawn: DrawnOutline, size_px: tuple[int, int], box_px: PixelBox | None) -> bytes | None:
    """Return an outline as a PNG mask of the whole upright photo of ``size_px`` (width, height), as for ``--mask``.

    ``box_px`` is the object's bounding box in the photo; the outline was drawn on a window around it. None if it was drawn on
    another part of the photo (inside a border that was cut off).
    """
    width, height = size_px
    left, top, right, bottom = (0, 0, width, height) if box_px is None else window_of(box_px, size_px, "the photo")
    window = (bottom - top, right - left)
    if not drawn.is_of(window):
        return None
    whole = np.zeros((height, width), np.uint8)
    whole[top:bottom, left:right] = drawn.scaled(window)
    encoded = io.BytesIO()
    Image.fromarray(whole).save(encoded, "PNG")
    return encoded.getvalue()


def _refused(detail: str) -> Rejected:
    return Rejected("low_confidence_matte", detail, "generate")
