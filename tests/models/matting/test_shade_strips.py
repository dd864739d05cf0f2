"""A strip of the ground's own tint beside a coloured thing, on scenes whose mask is known."""

from __future__ import annotations

import cv2
import numpy as np

from manitwin.models.matting.background import model_background
from manitwin.models.matting.outline import gradient_magnitude
from manitwin.models.matting.shade_strips import Strips, shade_strips

SIZE = (150, 200)
GROUND, RED = np.array([214.0, 206, 210]), (150.0, 30, 35)
THING, BESIDE = np.s_[40:110, 60:130], np.s_[110:118, 60:130]


def _found(thing: tuple[float, ...], beside: tuple[float, ...], *, soft_px: float) -> tuple[Strips, np.ndarray]:
    """Return what is found of a mask that has both the thing and the strip below it, and that strip."""
    light = np.tile(GROUND, (*SIZE, 1))
    strip = np.zeros(SIZE, bool)
    strip[BESIDE] = True
    share = cv2.GaussianBlur(strip.astype(np.float32), (0, 0), soft_px)[..., None]
    light = light * (1 - share) + np.array(beside) * share
    light[THING] = thing
    light = cv2.GaussianBlur(light, (0, 0), 0.7) + np.random.default_rng(0).normal(0, 1.0, light.shape)
    background = model_background(np.clip(light, 0, 255).astype(np.uint8))
    mask = strip.copy()
    mask[THING] = True
    found = shade_strips(background, mask, gradient_magnitude(background.lab))
    return found, strip


def test_dimmed_ground_along_a_coloured_thing_is_its_shadow() -> None:
    found, strip = _found(RED, tuple(0.7 * GROUND), soft_px=2.0)
    assert (found.shadow & strip).sum() > 0.6 * strip.sum()
    assert not found.shadow[40:109].any() and not found.doubtful.any()


def test_strip_of_another_tint_is_part_of_the_thing() -> None:
    found, _ = _found(RED, (150.0, 120, 60), soft_px=2.0)
    assert not found.shadow.any() and not found.doubtful.any()


def test_dimmed_ground_with_an_edge_as_sharp_as_the_things_own_is_doubted() -> None:
    found, strip = _found(RED, tuple(0.7 * GROUND), soft_px=0.3)
    assert not found.shadow.any()
    assert (found.doubtful & strip).sum() > 0.6 * strip.sum()


def test_nothing_is_told_of_a_thing_that_is_grey_itself() -> None:
    found, _ = _found(tuple(0.3 * GROUND), tuple(0.7 * GROUND), soft_px=2.0)
    assert not found.shadow.any() and not found.doubtful.any()
