"""The pixels of a photo to be cut out, given its alpha channel, a mask and the object's bounding box."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from manitwin.config import MattingConfig
from manitwin.formats.image_file import Photo, full_size, read_image
from manitwin.formats.outline_mask import require_mask
from manitwin.geometry.pixel_boxes import PixelBox, image_to_crop_box
from manitwin.pipeline.given_alpha import CutOutInput, apply_mask, interpret_alpha
from manitwin.pipeline.stated_place import window_of

CROPPED = "looked at within the box that was stated of it"


@dataclass(frozen=True)
class PhotoPixels:
    """The image to be cut out, ``given``, its focal length (35 mm equivalent), and the object's box in its pixels.

    ``window_px`` is the shown region in pixels of the whole photo; None if a border was cut off.
    """

    given: CutOutInput
    findings: tuple[str, ...]
    focal_mm: float | None
    box_px: PixelBox | None = None
    window_px: PixelBox | None = None


def pixels_of_photo(
    path: Path, name: str | None, settings: MattingConfig, *, mask: Path | None = None, box_px: PixelBox | None = None
) -> PhotoPixels:
    """Read a photo of an object called ``name``; ``mask`` is a mask image, ``box_px`` the object's bounding box.

    With a box, only the region around it is used, at full resolution. Raises InputError.
    """
    photo = read_image(path, frame=settings.frame, max_side_px=settings.photo_side_px if box_px is None else None)
    width, height, orientation = full_size(path)
    if mask is not None:
        require_mask(mask, None, (width, height), orientation)
    if box_px is None:
        given = interpret_alpha(photo.pixels, name) if mask is None else apply_mask(photo.pixels, mask, orientation)
        whole = (0.0, 0.0, float(width), float(height)) if given.pixels.shape[:2] == photo.pixels.shape[:2] else None
        return PhotoPixels(given, photo.findings, photo.focal_mm, window_px=whole)
    masked = None if mask is None else apply_mask(photo.pixels, mask, orientation)
    left, top, right, bottom = window_of(box_px, (photo.pixels.shape[1], photo.pixels.shape[0]), path.name)
    window = (float(left), float(top), float(right), float(bottom))
    cropped = (photo.pixels if masked is None else masked.pixels)[top:bottom, left:right]
    scale = min(1.0, settings.photo_side_px / max(cropped.shape[:2]))
    pixels = _scaled(cropped, scale)
    given = interpret_alpha(pixels, name) if masked is None else CutOutInput(pixels, masked.findings)
    return PhotoPixels(
        given,
        (*photo.findings, CROPPED),
        _focal_of_window(photo, cropped.shape),
        image_to_crop_box(box_px, window, scale),
        window if given.pixels.shape[:2] == pixels.shape[:2] else None,
    )


def _scaled(pixels: np.ndarray, scale: float) -> np.ndarray:
    if scale < 1:
        size = max(1, round(pixels.shape[1] * scale)), max(1, round(pixels.shape[0] * scale))
        return np.asarray(Image.fromarray(pixels).resize(size, Image.Resampling.BOX))
    return np.ascontiguousarray(pixels)


def _focal_of_window(photo: Photo, shape: tuple[int, ...]) -> float | None:
    """Return the 35 mm equivalent focal length of a crop of ``shape``, with the same angle of view per pixel."""
    if photo.focal_mm is None:
        return None
    height, width = photo.pixels.shape[:2]
    return photo.focal_mm * math.hypot(width, height) / math.hypot(shape[1], shape[0])
