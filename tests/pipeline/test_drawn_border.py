"""A border that a screen, an editor or a shop drew around a photo is cut off; a ground, or a thing that fills it, is not."""

from __future__ import annotations

import io

import cv2
import numpy as np
import pytest
from PIL import Image

from manitwin.pipeline.drawn_border import BORDERED, without_border
from manitwin.pipeline.given_alpha import interpret_alpha

HEIGHT, WIDTH = 240, 320


def scene(seed: int = 0) -> np.ndarray:
    """A red disc (240, 320, 3) uint8 on a pale ground in falling light, with the noise of a camera."""
    light = np.linspace(1.0, 0.9, WIDTH)[None, :, None]
    rgb = np.broadcast_to(np.array([226.0, 224.0, 220.0]) * light, (HEIGHT, WIDTH, 3)).copy()
    cv2.circle(rgb, (150, 120), 60, (170, 40, 30), -1)
    return np.clip(rgb + np.random.default_rng(seed).normal(0, 2, rgb.shape), 0, 255).astype(np.uint8)


def bordered(rgb: np.ndarray, px: tuple[int, int, int, int], shade: int) -> np.ndarray:
    """Return a picture with a border of so many pixels at the top, the bottom, the left and the right, as a JPEG has it."""
    top, bottom, left, right = px
    wide = cv2.copyMakeBorder(rgb, top, bottom, left, right, cv2.BORDER_CONSTANT, value=(shade, shade, shade))
    encoded = io.BytesIO()
    Image.fromarray(wide).save(encoded, "JPEG", quality=90)
    return np.asarray(Image.open(encoded).convert("RGB"))


@pytest.mark.parametrize("rectangular", [False, True, None])
@pytest.mark.parametrize("px", [(1, 1, 1, 1), (4, 4, 4, 4), (3, 0, 0, 5)])
def test_a_line_around_a_photo_is_cut_off(px: tuple[int, int, int, int], rectangular: bool | None) -> None:
    inside = without_border(bordered(scene(), px, 20), rectangular)
    assert inside is not None
    most = 3  # what JPEG mixed of line and photo goes, too
    assert HEIGHT - 2 * most <= inside.shape[0] <= HEIGHT and WIDTH - 2 * most <= inside.shape[1] <= WIDTH
    assert np.abs(inside[0].astype(int).mean(axis=1) - 213).max() < 20, "no part of the line is left"


def test_a_line_within_a_lighter_one_is_cut_off_with_it() -> None:
    twice = bordered(bordered(scene(), (2, 2, 2, 2), 20), (2, 2, 2, 2), 255)
    inside = without_border(twice, None)
    assert inside is not None and inside.shape[0] <= HEIGHT


def test_two_wide_bars_are_cut_off_what_has_no_upright_rectangle_for_its_outline() -> None:
    barred = bordered(scene(), (0, 0, 90, 90), 255)
    inside = without_border(barred, False)
    assert inside is not None and WIDTH - 6 <= inside.shape[1] <= WIDTH
    assert without_border(barred, True) is None and without_border(barred, None) is None, "it may be the thing"
    written = barred.copy()
    cv2.putText(written, "for lease", (4, 225), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (90, 90, 90), 1)
    inside = without_border(written, False)
    assert inside is not None and WIDTH - 6 <= inside.shape[1] <= WIDTH


def test_the_front_of_a_box_that_fills_its_picture_stays_in_it() -> None:
    front = (
        np.random.default_rng(1).integers(0, 256, (12, 16, 3)).astype(np.uint8).repeat(20, axis=0).repeat(20, axis=1)
    )
    picture = bordered(front, (5, 5, 5, 5), 255)
    assert without_border(picture, True) is None
    assert without_border(picture, None) is None


@pytest.mark.parametrize("shade", [0, 128, 255])
def test_a_ground_is_no_border(shade: int) -> None:
    ground = np.full((HEIGHT, WIDTH, 3), shade, np.uint8)
    cv2.circle(ground, (150, 120), 110, (170, 40, 30), -1)
    assert without_border(ground, False) is None
    assert without_border(scene(), False) is None


def test_a_sheet_whose_edge_runs_along_one_side_is_no_border() -> None:
    rgb = scene()
    rgb[:6] = 60
    assert without_border(rgb, False) is None


def test_what_is_looked_at_says_that_its_border_was_cut_off() -> None:
    given = interpret_alpha(bordered(scene(), (3, 3, 3, 3), 20), "mug")
    assert given.findings == (BORDERED,) and not given.is_doubted
    opaque = np.dstack([bordered(scene(), (3, 3, 3, 3), 20), np.full((HEIGHT + 6, WIDTH + 6), 255, np.uint8)])
    assert interpret_alpha(opaque, "mug").pixels.shape == given.pixels.shape, "an opaque alpha channel says nothing"
    assert interpret_alpha(scene(), "mug").findings == ()
