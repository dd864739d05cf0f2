"""PNG pictures of integers (ids, millimetres) with 8 or 16 bits per pixel; reading is safe for untrusted files."""

from __future__ import annotations

import io

import cv2
import numpy as np
from PIL import Image, UnidentifiedImageError

from manitwin.formats.bounded_file import Refusal
from manitwin.formats.printable import printable_line

MAX_PICTURE_BYTES = 256 << 20
MAX_PICTURE_PX = 16384
_MODES = {"L": np.uint8, "I;16": np.uint16}


def label_picture(numbers: np.ndarray) -> bytes:
    """Encode integers ``(H, W)`` of at most 65,535 as PNG, with 8 bits if they fit; deterministic."""
    wide = numbers.size > 0 and int(numbers.max()) > np.iinfo(np.uint8).max
    return bytes(cv2.imencode(".png", numbers.astype(np.uint16 if wide else np.uint8))[1].tobytes())


def parse_label_picture(content: bytes, name: str, refuse: Refusal, *, remedy: str) -> np.ndarray:
    """Return the integers ``(H, W)`` of a PNG; raises the error that ``refuse`` makes of a line for anything else."""
    called = printable_line(name)
    try:
        with Image.open(io.BytesIO(content), formats=("PNG",)) as picture:
            if picture.mode not in _MODES:
                raise refuse(f"{called}: has {picture.mode} pixels, not single-channel integers; {remedy}")
            if max(picture.size) > MAX_PICTURE_PX:
                raise refuse(f"{called}: {picture.size[0]} x {picture.size[1]} pixels; {remedy}")
            return np.asarray(picture, _MODES[picture.mode])
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        cause = (
            "not a PNG" if isinstance(error, UnidentifiedImageError) else printable_line(str(error), max_characters=120)
        )
        raise refuse(f"{called}: is not a readable PNG ({cause}); {remedy}") from error
