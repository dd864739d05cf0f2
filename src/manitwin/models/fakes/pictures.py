"""Pictures of the fake text-to-image services: a coloured disc on a light background."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image

SIDE_PX = 128
_GROUND = 235


def picture_png(seed: int, *, blank: bool = False) -> bytes:
    """Return a PNG that depends on the seed; ``blank`` gives a single colour, as some services return for refused prompts."""
    rng = np.random.default_rng(seed)
    pixels = np.full((SIDE_PX, SIDE_PX, 3), 0 if blank else _GROUND, np.uint8)
    if not blank:
        rows, columns = np.mgrid[:SIDE_PX, :SIDE_PX]
        inside = (rows - SIDE_PX / 2) ** 2 + (columns - SIDE_PX / 2) ** 2 < (SIDE_PX * rng.uniform(0.2, 0.4)) ** 2
        pixels[inside] = rng.integers(20, 200, 3)
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    return stream.getvalue()
