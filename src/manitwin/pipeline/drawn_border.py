"""Detection of borders drawn or padded around a photo (by screens, editors, shops): lines or bars of a single colour.

The image inside a border is an upright rectangle that contrasts with its surroundings, and would be mistaken for the object.
"""

from __future__ import annotations

import numpy as np

from manitwin.formats.image_file import MIN_SIDE_PX

THIN = 0.04
"""Fraction of an image's side: largest width of a line; anything wider may be the background of an object."""
WIDE = 0.45
"""Fraction of an image's side: largest width of a bar, which must have a similar one on the opposite side."""
LEAST_ALONG = 0.95
"""Least fraction of a side's length over which a border has one colour and ends in one row; the rest is corners and noise."""
LEAST_OF_BAR = 0.9
"""The same for a wide bar, which may contain text."""
ALIKE, STEP = 16, 24
"""Grey levels within which a border has one colour, and beyond which the content starts; JPEG blurs smaller steps."""
MIXED_PX = 2
"""Rows between border and content that JPEG and scaling may mix."""
LEAST_SIDES = 2
OF_GROUND = 0.75
"""Least fraction of one colour among the outermost pixels of the content for which they count as background."""
BORDERED = "a border drawn around the picture was cut off"


def without_border(pixels: np.ndarray, rectangular: bool | None) -> np.ndarray | None:
    """Return the image ``(H, W, 3) uint8`` inside the border drawn around ``pixels``; None if there is no border.

    ``rectangular``: whether the object has an upright rectangular outline (None: unknown). If it has not, the content is the
    image, even between two wide bars. Otherwise the content may be the object itself, such as the front of a box: it is an
    image only if it has a background of its own, of one colour along its sides.
    """
    if pixels.shape[2] != 3:
        return None
    lines = _lines(pixels)
    if sum(width > 0 for width in lines) >= LEAST_SIDES:
        inside = _within(pixels, lines)
        if inside is not None and (rectangular is False or _has_ground(inside)):
            return inside
    return _within(pixels, _bars(pixels)) if rectangular is False else None


def _lines(pixels: np.ndarray) -> tuple[int, int, int, int]:
    """Return the number of rows and columns of ``pixels (H, W, 3)`` that are border lines: top, bottom, left, right."""
    found = []
    for seen in _from_each_side(pixels):
        most, width = int(THIN * len(seen)), 0
        while (step := _bar(seen[width:], most - width)) > 0:  # a line may have a lighter one around it
            width += step
        found.append(width)
    top, bottom, left, right = found
    return top, bottom, left, right


def _bars(pixels: np.ndarray) -> tuple[int, int, int, int]:
    """Return the rows and columns (as ``_lines``) of two bars of one colour on opposite sides; zeros if there are none."""
    sides = _from_each_side(pixels)
    widths = [_bar(seen, int(WIDE * len(seen)), LEAST_OF_BAR) for seen in sides]
    colours = [np.median(seen[0].astype(np.float32), axis=0) for seen in sides]
    for first in (0, 2):
        if not (widths[first] and widths[first + 1]) or np.abs(colours[first] - colours[first + 1]).max() > ALIKE:
            widths[first : first + 2] = 0, 0
    top, bottom, left, right = widths
    return top, bottom, left, right


def _bar(seen: np.ndarray, most_px: int, least: float = LEAST_ALONG) -> int:
    """Return how many rows of ``seen (n, m, 3)``, from the first, have one colour and end in a step along their whole length.

    ``least`` is the share of each row that must have the colour. Rows that mix both sides of the step are included. 0 if this
    exceeds ``most_px``, or if there is no such step.
    """
    if most_px < 1:
        return 0
    rows = seen[: most_px + MIXED_PX + 1].astype(np.int16)
    off = np.abs(rows - np.median(rows[0], axis=0).astype(np.int16)).max(axis=2)
    like = (off <= ALIKE).mean(axis=1) >= least
    width = len(like) if like.all() else int(np.argmin(like))
    if width == 0:
        return 0
    for ends in range(width, min(width + MIXED_PX, len(rows) - 1) + 1):
        if ends <= most_px and (off[ends] > STEP).mean() >= LEAST_ALONG:
            return ends
    return 0


def _from_each_side(pixels: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return views of an image (H, W, 3) whose first rows are its top, bottom, left and right side."""
    across = np.swapaxes(pixels, 0, 1)
    return pixels, pixels[::-1], across, across[::-1]


def _within(pixels: np.ndarray, border: tuple[int, int, int, int]) -> np.ndarray | None:
    """Return an image (H, W, 3) without its ``border`` rows and columns; None if there is none, or if too little is left."""
    top, bottom, left, right = border
    inside = pixels[top : pixels.shape[0] - bottom, left : pixels.shape[1] - right]
    if not any(border) or min(inside.shape[:2]) < MIN_SIDE_PX:
        return None
    return np.ascontiguousarray(inside)


def _has_ground(pixels: np.ndarray) -> bool:
    """Return whether most of the outermost pixels of an image (H, W, 3) have one colour."""
    ring = np.concatenate([seen[0] for seen in _from_each_side(pixels)]).astype(np.int16)
    off = np.abs(ring - np.median(ring, axis=0).astype(np.int16)).max(axis=1)
    return bool((off <= ALIKE).mean() >= OF_GROUND)
