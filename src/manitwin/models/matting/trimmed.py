"""Detection of photos that were trimmed to the object: product pictures on one pure colour whose frame touches the object.

An object that ends at the frame looks cut off, and hardly any background is left to compare with it. If the background has
exactly one pixel value, as no photographed surface has, it can be extended beyond the frame.
"""

from __future__ import annotations

import numpy as np

MARGIN = 0.08
"""Width of the margin added to every side, as a share of the longer side."""
MOST_DEVIATION = 2.0
"""Maximum median deviation of the frame's background from its colour, in 8-bit levels.

JPEG noise stays below it; a wall in a photo deviates by 4 or more.
"""
EXACT_SHARE = 0.75
"""Share of the frame's background within ``MOST_DEVIATION`` for an exact colour.

In evenly lit photos with half of it within, a quarter deviates by 4 or more; on a digitally filled background none does.
"""
OF_GROUND, LEAST_GROUND = 24.0, 0.5
"""Maximum deviation in 8-bit levels of a background pixel from the background colour, and the minimum share of such pixels."""
NEAR = 0.02
"""Share of the longer side; an object that ends this near to a side was trimmed there."""
CLOSE, WHITE = 0.06, 250.0
"""A gap of more than ``CLOSE`` of the longer side on every side leaves enough background.

An object that touches no side gets a margin only on white, since shops place cut-outs on white; light falloff over another
colour need not continue beyond the frame.
"""
MOST_CONTACT = 0.5
"""Share of the object's extent along a side that touches it: a trimmed object curves away, one that is cut off runs across it."""
FRAME_PX = 2


def trimmed_margin(rgb: np.ndarray) -> tuple[int, np.ndarray] | None:
    """Return the margin (px) to restore around a trimmed photo ``rgb (H, W, 3) uint8``, and its colour ``(3,) uint8``; else None.

    A photo counts as trimmed if the object ends near a side of a white picture and touches no side; or ends near two opposite
    sides and touches none with most of its extent; or ends near all four.
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


def uniform_background_colour(rgb: np.ndarray) -> np.ndarray | None:
    """Return the one digital colour ``(3,) float32`` of the background of ``rgb (H, W, 3) uint8``; None if it has several.

    The frame of the picture decides.
    """
    return _ground_of_frame(rgb, EXACT_SHARE)


def _ground_of_frame(rgb: np.ndarray, share: float) -> np.ndarray | None:
    """Return the colour ``(3,) float32`` of a frame that is mostly background; else None.

    A ``share`` of the background pixels must be within ``MOST_DEVIATION`` of that colour.
    """
    if min(rgb.shape[:2]) <= 4 * FRAME_PX:
        return None
    ring = np.concatenate([side.reshape(-1, 3) for side in _sides(rgb)]).astype(np.float32)
    colour = np.asarray(np.median(ring, axis=0), np.float32)
    off = np.abs(ring - colour).max(axis=1)
    ground = off <= OF_GROUND
    if ground.mean() < LEAST_GROUND or np.percentile(off[ground], 100 * share) > MOST_DEVIATION:
        return None
    return colour


def restore_margin(rgb: np.ndarray) -> tuple[np.ndarray, int]:
    """Return a photo ``rgb (H, W, 3) uint8`` with the trimmed margin restored on every side, and the margin in pixels.

    A photo that was not trimmed is returned unchanged, with margin 0.
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
    """Return the outermost rows and columns of a picture (top, bottom, left, right), each ``(FRAME_PX, n, ...)``."""
    across = np.swapaxes(picture, 0, 1)
    return picture[:FRAME_PX], picture[-FRAME_PX:], across[:FRAME_PX], across[-FRAME_PX:]
