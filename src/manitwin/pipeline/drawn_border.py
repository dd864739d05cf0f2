"""A border around a photo: lines or bars of one colour that were drawn or padded around it, by a screen, an editor or a shop.

What lies within is an upright rectangle that differs from what is around it, as a thing on a ground does, and is none.
"""

from __future__ import annotations

import numpy as np

from manitwin.formats.image_file import MIN_SIDE_PX

THIN = 0.04
"""Of a picture's side: a border as thin as that is a line; what is wider may be the ground of a thing."""
WIDE = 0.45
"""Of a picture's side: a bar beside a picture, which has another like it at the opposite side."""
LEAST_ALONG = 0.95
"""Of a side's length, along which a border has one colour, and ends in one row of pixels: the rest are corners and noise."""
LEAST_OF_BAR = 0.9
"""The same of a wide bar, across which somebody may have written."""
ALIKE, STEP = 16, 24
"""Levels within which a border has one colour, and beyond which what follows is another: JPEG smears steps by less."""
MIXED_PX = 2
"""Rows between a border and what lies within, which JPEG and scaling mix of both."""
LEAST_SIDES = 2
OF_GROUND = 0.75
"""Of the outermost pixels of what lies within: as many of one colour are a ground, and what is on it need not be a print."""
BORDERED = "a border drawn around the picture was cut off"


def without_border(pixels: np.ndarray, rectangular: bool | None) -> np.ndarray | None:
    """Return the picture ``(H, W, 3) uint8`` within the border that was drawn around ``pixels``; None where there is none.

    ``rectangular`` is whether the thing that is meant has an upright rectangle for its outline, None where nobody says what it
    is. Of one that has none, what lies within is the picture, also between two wide bars. Else it may be the thing itself, the
    front of a box: it is a picture only where it has a ground of its own, of one colour along its sides.
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
    """Return how many rows and columns of ``pixels (H, W, 3)`` are lines, at the top, the bottom, the left and the right."""
    found = []
    for seen in _from_each_side(pixels):
        most, width = int(THIN * len(seen)), 0
        while (step := _bar(seen[width:], most - width)) > 0:  # a line may itself have a lighter one around
            width += step
        found.append(width)
    top, bottom, left, right = found
    return top, bottom, left, right


def _bars(pixels: np.ndarray) -> tuple[int, int, int, int]:
    """Return the rows and columns, as ``_lines`` does, of two bars of one colour at opposite sides; zeros without such."""
    sides = _from_each_side(pixels)
    widths = [_bar(seen, int(WIDE * len(seen)), LEAST_OF_BAR) for seen in sides]
    colours = [np.median(seen[0].astype(np.float32), axis=0) for seen in sides]
    for first in (0, 2):
        if not (widths[first] and widths[first + 1]) or np.abs(colours[first] - colours[first + 1]).max() > ALIKE:
            widths[first : first + 2] = 0, 0
    top, bottom, left, right = widths
    return top, bottom, left, right


def _bar(seen: np.ndarray, most_px: int, least: float = LEAST_ALONG) -> int:
    """Return how many rows of ``seen (n, m, 3)``, from the first, are of one colour and end in a step along all of their length.

    ``least`` is the share of each row that has the colour. Rows that are mixed of both sides of the step count. 0 where these
    would be more than ``most_px``, or there is no such step.
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
    """Return views of a picture (H, W, 3) whose first rows are its top, its bottom, its left and its right side."""
    across = np.swapaxes(pixels, 0, 1)
    return pixels, pixels[::-1], across, across[::-1]


def _within(pixels: np.ndarray, border: tuple[int, int, int, int]) -> np.ndarray | None:
    """Return a picture (H, W, 3) without its ``border`` of rows and columns; None without one, or where too little is left."""
    top, bottom, left, right = border
    inside = pixels[top : pixels.shape[0] - bottom, left : pixels.shape[1] - right]
    if not any(border) or min(inside.shape[:2]) < MIN_SIDE_PX:
        return None
    return np.ascontiguousarray(inside)


def _has_ground(pixels: np.ndarray) -> bool:
    """Tell whether most of the outermost pixels of a picture (H, W, 3) are of one colour."""
    ring = np.concatenate([seen[0] for seen in _from_each_side(pixels)]).astype(np.int16)
    off = np.abs(ring - np.median(ring, axis=0).astype(np.int16)).max(axis=1)
    return bool((off <= ALIKE).mean() >= OF_GROUND)
