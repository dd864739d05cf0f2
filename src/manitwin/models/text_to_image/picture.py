"""Validation of a generated picture that is used like a photo."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from manitwin.errors import InputError
from manitwin.formats.image_file import read_image

_PLAIN = 2.0
"""Standard deviation of 8-bit values below which a picture is blank, e.g. a black one returned for a refused prompt."""


def picture_flaw(path: Path) -> str | None:
    """Return why a picture cannot be used, None if it can: it must be readable as a photo and not be blank."""
    try:
        pixels = read_image(path, max_side_px=256).pixels[..., :3]
    except InputError as error:
        return f"what was made is no picture: {error.detail}"
    if float(np.std(pixels.astype(float), axis=(0, 1)).max()) < _PLAIN:
        return "the picture is of one colour"
    return None
