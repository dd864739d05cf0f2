"""The light of photos that are painted here: a ground of a known matter, a thing of a known colour."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from manitwin.formats.meshes.textures import linear_to_srgb
from manitwin.models.annotators.photo_light import (
    MOST_SHEEN,
    PALE_REFLECTANCE,
    estimate_mean_light,
    estimate_photo_light,
)
from manitwin.models.annotators.surface_color import color_name, lab_from_srgb


def photo(ground: tuple[float, float, float], thing: tuple[float, float, float], exposure: float) -> np.ndarray:
    """A disc of a thing on a ground, both linear reflectances, under a light of so much of the picture's white."""
    y, x = np.mgrid[:300, :400]
    inside = np.hypot(x - 200, y - 150) < 90
    linear = np.where(inside[..., None], thing, ground) * exposure
    rgb = np.rint(255 * linear_to_srgb(np.clip(linear, 0, 1))).astype(np.uint8)
    return np.dstack([rgb, np.where(inside, 255, 0).astype(np.uint8)])


PALE = (PALE_REFLECTANCE,) * 3


@pytest.mark.parametrize("exposure", [0.45, 0.7, 1.0])
def test_the_light_is_that_which_a_pale_ground_tells(exposure: float) -> None:
    light = estimate_photo_light(photo(PALE, (0.3, 0.3, 0.3), exposure))
    assert light is not None
    assert light.white == pytest.approx(exposure, abs=0.02)
    assert light.sheen == MOST_SHEEN


def test_a_yellow_thing_in_little_light_is_yellow() -> None:
    rgba = photo(PALE, (0.85, 0.60, 0.03), 0.35)
    light = estimate_photo_light(rgba)
    assert light is not None
    seen = rgba[150, 200, :3] / 255
    assert color_name(lab_from_srgb(seen), metallic=False) != "yellow"
    assert color_name(lab_from_srgb(light.object_colors(seen)), metallic=False) == "yellow"


@pytest.mark.parametrize("ground", [(0.5, 0.28, 0.12), (0.4, 0.15, 0.25), (0.05, 0.05, 0.05)])
def test_a_tinted_or_dark_ground_tells_nothing(ground: tuple[float, float, float]) -> None:
    assert estimate_photo_light(photo(ground, (0.3, 0.3, 0.3), 0.9)) is None


def test_a_thing_that_fills_the_photo_leaves_no_ground() -> None:
    assert estimate_photo_light(np.full((64, 64, 4), 255, np.uint8)) is None


def test_what_is_darker_than_the_sheen_has_less_of_it() -> None:
    light = estimate_photo_light(photo(PALE, (0.012, 0.004, 0.002), 0.7))
    assert light is not None
    assert light.sheen < 0.006


def test_of_several_photos_each_must_tell_the_light(tmp_path: Path) -> None:
    told, untold = photo(PALE, (0.3, 0.3, 0.3), 0.5), photo((0.05, 0.05, 0.05), (0.3, 0.3, 0.3), 0.5)
    paths = [tmp_path / f"{number}.png" for number in range(3)]
    for path, rgba in zip(paths, (told, photo(PALE, (0.3, 0.3, 0.3), 0.8), untold), strict=True):
        Image.fromarray(rgba).save(path)
    light = estimate_mean_light(paths[:2])
    assert light is not None
    assert light.white == pytest.approx(np.sqrt(0.5 * 0.8), abs=0.02)
    assert estimate_mean_light(paths) is None
    assert estimate_mean_light([]) is None
