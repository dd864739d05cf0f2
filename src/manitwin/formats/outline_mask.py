"""Reader of an object mask beside a photo: white, or opaque, where the object is."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image

from manitwin.errors import InputError
from manitwin.formats.image_file import full_size, read_image
from manitwin.formats.printable import printable_line

MOST_TINT = 64
"""Largest difference between the colour channels of bright pixels, of 255: lossy compression tints a mask."""
LEAST_LEFT_OUT = 0.02
"""Least share of a picture that a mask must exclude; less is no cut-out (as for alpha channels)."""
_HALF = 0.5
LEAST_OF_LEVEL = 0.05
"""Share of the non-black pixels at one level from which on it cannot be a smooth edge."""
LOSSES, FEW = 0.1, 16
"""Relative deviation of levels by scaling or lossy compression, of the main level; not tolerated below ``FEW`` levels."""
_TURNED = {6: -1, 8: 1}  # counter-clockwise quarter turns that make a stored picture upright

_refused = partial(InputError, "unreadable")


def require_mask(path: Path, folder: Path | None, size_px: tuple[int, int], orientation: int) -> None:
    """Raise InputError for a mask that does not exist, lies outside ``folder``, or differs in size from its photo.

    ``size_px`` is the width and height of the upright photo. A mask of the photo as stored is also accepted if its EXIF
    ``orientation`` is a quarter turn. Only the header is read.
    """
    called = _shown_name(path)
    try:
        is_inside = folder is None or path.resolve().is_relative_to(folder.resolve())
        is_there = path.is_file()
    except (OSError, RuntimeError, ValueError):  # a name that no file can have, or a loop of links
        is_inside, is_there = True, False
    if not is_inside:
        raise _refused(f"{called}: a link that leads out of the folder of the poses; keep the masks below it")
    if not is_there:
        raise _refused(f"{called}: no mask is there; put it there, or leave the mask out")
    width, height, _ = full_size(path)
    if (width, height) != size_px and not (orientation in _TURNED and (height, width) == size_px):
        raise _refused(
            f"{called}: a mask of {width} x {height} pixels, and its photo has {size_px[0]} x {size_px[1]}; give the mask at the"
            " photo's size, or leave the mask out"
        )


def read_mask(path: Path, shape: tuple[int, int], orientation: int = 1) -> np.ndarray:
    """Return the mask of a photo of ``shape`` (rows, columns), upright: ``(H, W) uint8``, 255 for pixels of the object.

    The mask is an alpha channel that is not constant, or else the brightest channel, stretched to a maximum of 255.
    ``orientation`` is that of the photo's EXIF: a mask of the transposed shape is rotated like the photo. Raises InputError for
    a picture that is no object mask: one with several colours, one that numbers several objects, one that is nearly constant,
    and one that covers most of the border (a mask of what to exclude from a scene).
    """
    pixels, called = read_image(path).pixels, _shown_name(path)
    if pixels.shape[2] == 4 and np.ptp(pixels[..., 3]):
        mask = pixels[..., 3]
    else:
        mask = pixels[..., :3].max(axis=2)
        if _spread_of_colour(pixels, mask) > MOST_TINT:
            raise _refused(
                f"{called}: a mask with several colours; give one that is white where the thing is and black elsewhere"
            )
        _require_single_level(mask, called)
    if orientation in _TURNED and (mask.shape[0] > mask.shape[1]) != (shape[0] > shape[1]):
        mask = np.rot90(mask, _TURNED[orientation])
    highest = int(mask.max())
    if not highest:
        raise _refused(
            f"{called}: a mask that is black everywhere; make it white where the thing is, or leave the mask out"
        )
    mask = np.rint(mask * (255 / highest)).astype(np.uint8)
    taken = mask > 127
    border = np.concatenate([taken[0], taken[-1], taken[:, 0], taken[:, -1]])
    if (~taken).mean() < LEAST_LEFT_OUT or border.mean() > _HALF:
        raise _refused(
            f"{called}: a mask that keeps the border of the picture: it says what to leave out of a scene, and not where the"
            " thing is; make it black around the thing, or leave the mask out"
        )
    if mask.shape != shape:
        mask = np.asarray(Image.fromarray(mask).resize(shape[::-1], Image.Resampling.BOX))
    return np.ascontiguousarray(mask)


def _spread_of_colour(pixels: np.ndarray, mask: np.ndarray) -> float:
    """Return the largest difference of the channels among bright pixels, of 255, after scaling their brightest channel to 255."""
    bright = mask > mask.max() * _HALF
    if not bright.any():
        return 0.0
    full = np.float32(255) / mask[bright]
    return max(float(np.ptp(pixels[..., channel][bright] * full)) for channel in range(3))


def _require_single_level(mask: np.ndarray, called: str) -> None:
    """Raise InputError for a picture with areas at several levels: a map of several numbered objects."""
    counts = np.bincount(mask.ravel(), minlength=256)
    counts[0] = 0
    levels = np.flatnonzero(counts)
    if not len(levels):
        return
    counts = counts[levels]
    main = float(levels[np.argmax(counts)])
    is_other = (
        (levels != main) if levels[-1] < FEW else (levels > LOSSES * 255) & (np.abs(levels - main) > LOSSES * main)
    )
    if (counts[is_other] > LEAST_OF_LEVEL * counts.sum()).any():
        shown = ", ".join(str(level) for level in levels[:8]) + (", ..." if len(levels) > 8 else "")
        raise _refused(
            f"{called}: a mask of several levels ({shown}), as where things are numbered; give one that is white where this thing"
            " is and black elsewhere"
        )


def _shown_name(path: Path) -> str:
    return printable_line("/".join(path.parts[-2:]), max_characters=120)
