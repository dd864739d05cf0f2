"""Photos that were trimmed to the thing: pictures of shops, on one pure colour, whose edges lie where the thing ends.

A thing that ends at the frame looks cut off by it, and next to nothing of the ground is left to tell it from. Where the ground is
of one colour to the level, as no photographed surface is, it goes on the same beyond the frame.
"""

from __future__ import annotations

import numpy as np

MARGIN = 0.08
"""Of the longer side: what is given to every side."""
MOST_DEVIATION = 2.0
"""Levels by which half of the frame's ground may be off its colour: JPEG's own noise. A wall in a photo is off by 4 and more."""
EXACT_SHARE = 0.75
"""Of the frame's ground, within ``MOST_DEVIATION``: where half is, a quarter is off by 4 and more in even light of a camera, and
by none where somebody filled it."""
OF_GROUND, LEAST_GROUND = 24.0, 0.5
"""Levels from the ground's colour within which a pixel is ground, and how much of the frame has to be."""
NEAR = 0.02
"""Of the longer side: what ends so near to a side was trimmed there."""
CLOSE, WHITE = 0.06, 250.0
"""Of the longer side: what leaves more on every side has ground enough. What touches none is given more on white alone, onto
which shops cut things out; light that falls off over another colour need not go on."""
MOST_CONTACT = 0.5
"""Of a thing's extent along a side: a thing that was trimmed bends away from the frame, what is cut off runs across it."""
FRAME_PX = 2


def trimmed_margin(rgb: np.ndarray) -> tuple[int, np.ndarray] | None:
    """Return the margin (px) that was trimmed off a photo ``rgb (H, W, 3) uint8``, and its colour ``(3,) uint8``; else None.

    It was where the thing ends near a side of a white picture, and touches none; near two opposite sides, and touches none with
    most of its extent; or near all four.
    """
    height, width = rgb.shape[:2]
    if (colour := _ground_of_frame(rgb, 0.5)) is None:
        return None
    thing = np.abs(rgb.astype(np.int16) - np.round(colour).astype(np.int16)).max(axis=2) > OF_GROUND
    rows, columns = np.nonzero(thing.any(axis=1))[0], np.nonzero(thing.any(axis=0))[0]
    if not len(rows):
        return None
    longer = max(height, width)
    gaps = np.array([rows[0], height - 1 - rows[-1], columns[0], width - 1 - columns[-1]]) / longer
    extents = (np.ptp(columns) + 1, np.ptp(columns) + 1, np.ptp(rows) + 1, np.ptp(rows) + 1)
    near = gaps <= NEAR
    if gaps.min() > CLOSE:
        return None
    touching = [
        float(side.reshape(FRAME_PX, -1).any(axis=0).sum() / extent)
        for side, extent in zip(_sides(thing), extents, strict=True)
    ]
    opposite = bool(near[:2].all() or near[2:].all())
    if not (
        near.all() or (opposite and max(touching) <= MOST_CONTACT) or (not any(touching) and colour.min() >= WHITE)
    ):
        return None
    return max(1, round(MARGIN * longer)), np.round(colour).astype(np.uint8)


def exact_ground(rgb: np.ndarray) -> np.ndarray | None:
    """Return the one digital colour ``(3,) float32`` that the ground of ``rgb (H, W, 3) uint8`` has, by its frame; else None."""
    return _ground_of_frame(rgb, EXACT_SHARE)


def _ground_of_frame(rgb: np.ndarray, share: float) -> np.ndarray | None:
    """Return the colour ``(3,) float32`` of a frame that is mostly ground, a ``share`` of it next to that; else None."""
    if min(rgb.shape[:2]) <= 4 * FRAME_PX:
        return None
    ring = np.concatenate([side.reshape(-1, 3) for side in _sides(rgb)]).astype(np.float32)
    colour = np.asarray(np.median(ring, axis=0), np.float32)
    off = np.abs(ring - colour).max(axis=1)
    ground = off <= OF_GROUND
    if ground.mean() < LEAST_GROUND or np.percentile(off[ground], 100 * share) > MOST_DEVIATION:
        return None
    return colour


def with_margin(rgb: np.ndarray) -> tuple[np.ndarray, int]:
    """Return a photo ``rgb (H, W, 3) uint8`` with the margin that was trimmed off it on every side, and that margin in pixels.

    It is the photo itself, and 0, where it was not trimmed.
    """
    found = trimmed_margin(rgb)
    if found is None:
        return rgb, 0
    margin_px, colour = found
    height, width = rgb.shape[:2]
    wider = np.empty((height + 2 * margin_px, width + 2 * margin_px, 3), np.uint8)
    wider[:] = colour
    wider[margin_px : margin_px + height, margin_px : margin_px + width] = rgb
    return wider, margin_px


def _sides(picture: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return a picture's outermost rows and columns, top, bottom, left and right, each ``(FRAME_PX, n, ...)``."""
    across = np.swapaxes(picture, 0, 1)
    return picture[:FRAME_PX], picture[-FRAME_PX:], across[:FRAME_PX], across[-FRAME_PX:]
