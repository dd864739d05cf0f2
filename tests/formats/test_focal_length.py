"""The focal length of photos: as EXIF states it, from the sensor's size, and not where it cannot be true."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from manitwin.formats.focal_length import (
    EXIF_IFD,
    FOCAL_LENGTH_35MM,
    FOCAL_LENGTH_MM,
    HEIGHT_PX,
    PLANE_UNIT,
    PLANE_X_RESOLUTION,
    WIDTH_PX,
)
from manitwin.formats.image_file import Photo, read_image


def photo(folder: Path, stated: dict[int, float], size: tuple[int, int] = (96, 64)) -> Photo:
    path = folder / "photo.jpg"
    exif = Image.Exif()
    exif.get_ifd(EXIF_IFD).update(stated)
    Image.new("RGB", size, (200, 30, 30)).save(path, exif=exif)
    return read_image(path, max_side_px=32)


@pytest.mark.parametrize(
    ("stated", "focal_mm"),
    [
        ({}, None),
        ({FOCAL_LENGTH_35MM: 28}, 28.0),
        ({FOCAL_LENGTH_35MM: 0}, None),  # EXIF: unknown
        # a full-frame sensor: 36 x 24 mm with 96 x 64 pixels
        ({FOCAL_LENGTH_MM: 50.0, PLANE_X_RESOLUTION: 96 / 3.6, PLANE_UNIT: 3}, 50.0),
        ({FOCAL_LENGTH_MM: 50.0}, None),
        ({FOCAL_LENGTH_35MM: 28, WIDTH_PX: 960, HEIGHT_PX: 640}, 28.0),  # scaled since
        ({FOCAL_LENGTH_35MM: 28, WIDTH_PX: 640, HEIGHT_PX: 960}, 28.0),  # and turned
    ],
)
def test_focal_length_is_read_where_it_is_stated(
    tmp_path: Path, stated: dict[int, float], focal_mm: float | None
) -> None:
    found = photo(tmp_path, stated)
    assert found.focal_mm == (None if focal_mm is None else pytest.approx(focal_mm, rel=2e-3))
    assert not any("EXIF" in each for each in found.findings)


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({FOCAL_LENGTH_35MM: 3}, "3 mm, which no lens has"),
        ({FOCAL_LENGTH_35MM: 60_000}, "which no lens has"),
        ({FOCAL_LENGTH_35MM: 28, WIDTH_PX: 960, HEIGHT_PX: 960}, "cropped since"),
    ],
)
def test_focal_length_that_cannot_be_true_is_not_used_and_said(
    tmp_path: Path, stated: dict[int, float], words: str
) -> None:
    found = photo(tmp_path, stated)
    assert found.focal_mm is None and any(words in each for each in found.findings)
    assert found.pixels.shape == (21, 32, 3) and np.ptp(found.pixels[..., 0]) < 10
