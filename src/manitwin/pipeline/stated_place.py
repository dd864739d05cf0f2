"""The object's location in a photo, as stated by a person or data set: a bounding box in pixels, or a mask image."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from manitwin.errors import InputError, UsageError
from manitwin.formats.image_file import MIN_SIDE_PX
from manitwin.formats.printable import printable_line
from manitwin.formats.source_files import MESH_SUFFIXES
from manitwin.geometry.pixel_boxes import PixelBox

MASK, BOX = "mask", "box_px"
"""Columns of a manifest."""
MARGIN = 0.15
"""Fraction of the box's longer side: margin of the photo that is used around the box, for background and object edges."""
LEAST_MARGIN_PX = 8.0
OUTSIDE_PX = 1.0
"""Tolerance for boxes outside their photo, as programs count pixels from 0 or 1."""
_EXAMPLE = "left,top,right,bottom in pixels, such as 120,80,410,395"
_SHOWN = 60


def stated_box_px(said: object, where: str) -> PixelBox | None:
    """Return the stated bounding box of an object, None if there is none; from a text of four numbers, or a sequence.

    The edges are in pixels of the upright photo at its own size. Raises UsageError for anything else.
    """
    if said is None or said == "":
        return None
    words = re.split(r"[\s,;]+", said.strip(" ()[]")) if isinstance(said, str) else said
    try:
        numbers = [float(number) for number in words] if isinstance(words, Sequence) else []
    except (TypeError, ValueError):
        numbers = []
    shown = printable_line(str(said), max_characters=_SHOWN)
    if len(numbers) != 4 or not all(map(math.isfinite, numbers)):
        raise UsageError(f"{where}: {BOX} is {shown}; give {_EXAMPLE}")
    left, top, right, bottom = numbers
    if left >= right or top >= bottom:
        raise UsageError(
            f"{where}: {BOX} is {shown}: the right and bottom edges must lie beyond the left and top edges; give"
            f" {_EXAMPLE} (not a"
            " width and a height)"
        )
    return left, top, right, bottom


def stated_mask(said: object, folder: Path, where: str) -> str | None:
    """Return the absolute path of a photo's stated mask; None if there is none. Raises UsageError if the file does not exist."""
    if said is None or said == "":
        return None
    path = os.path.realpath(os.path.join(folder, str(said)))
    if not os.path.isfile(path):
        shown = printable_line(path, max_characters=200)
        raise UsageError(f"{where}: {MASK}: {shown} is not a file; paths are absolute or relative to the manifest")
    return path


def require_of_photo(values: Mapping[str, Any], file: str | None, where: str) -> None:
    """Raise UsageError if a mask or box is stated for an input that is not a photo."""
    said = [column for column in (MASK, BOX) if values.get(column) not in (None, "", ())]
    if said and (file is None or Path(file).suffix.lower() in MESH_SUFFIXES):
        what = "a text" if file is None else "a mesh"
        raise UsageError(f"{where}: {said[0]}: applies to photos, but this is {what}; leave it out")


def require_one_photo(inputs: Sequence[str | Path], texts: Sequence[str], *, views: bool) -> None:
    """Raise UsageError if a mask or box is given with other inputs than one file; manifest rows have their own."""
    one = len(inputs) == 1 and not texts and not views
    if not one or os.path.isdir(inputs[0]) or Path(inputs[0]).suffix.lower() in (".csv", ".jsonl"):
        raise UsageError(
            f"a mask or a box applies to one photo; for several photos write a manifest with the columns {MASK} and"
            f" {BOX}"
        )


def window_of(box_px: PixelBox, size_px: tuple[int, int], name: str) -> tuple[int, int, int, int]:
    """Return the region of a photo of ``size_px`` (width, height) around a box: left, top, right, bottom in whole pixels.

    Raises InputError for a box outside the photo, or too small to show anything.
    """
    (left, top, right, bottom), (width, height) = box_px, size_px
    told = f"{left:g},{top:g},{right:g},{bottom:g}"
    if min(left, top) < -OUTSIDE_PX or right > width + OUTSIDE_PX or bottom > height + OUTSIDE_PX:
        raise InputError(
            "unreadable",
            f"{name}: the box {told} lies outside the photo, which is {width} x {height} pixels as it stands upright; give"
            f" {_EXAMPLE}",
        )
    if min(right - left, bottom - top) < MIN_SIDE_PX / 4 or max(right - left, bottom - top) < MIN_SIDE_PX:
        raise InputError(
            "too_small",
            f"{name}: the box {told} has {right - left:g} x {bottom - top:g} pixels, its longer side must have at least"
            f" {MIN_SIDE_PX}; give a larger photo",
        )
    margin = max(LEAST_MARGIN_PX, MARGIN * max(right - left, bottom - top))
    return (
        max(0, math.floor(left - margin)),
        max(0, math.floor(top - margin)),
        min(width, math.ceil(right + margin)),
        min(height, math.ceil(bottom + margin)),
    )


def as_box(numbers: Sequence[float]) -> PixelBox | None:
    """Return the four numbers of an item as a box; None if there are none."""
    return (numbers[0], numbers[1], numbers[2], numbers[3]) if numbers else None
