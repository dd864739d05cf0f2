"""Ground that is seen inside a mask, on scenes where it is known."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.errors import Rejected
from manitwin.models.matting.background import model_background
from manitwin.models.matting.enclosed_background import enclosed_background_share
from manitwin.models.matting.matte import matte_photo
from manitwin.models.matting.outline import edge_threshold, gradient_magnitude

SIZE = (240, 320)
GROUND = np.array([186.0, 190, 196])
SLOTS = tuple(np.s_[y : y + 7, 130:190] for y in (100, 118, 136))


def _blade(slot: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return a photo of a dark blade whose slots have a colour, and the blade's mask with the slots filled."""
    light = np.tile(GROUND, (*SIZE, 1))
    mask = np.zeros(SIZE, bool)
    mask[80:160, 110:210] = True
    light[mask] = (88, 84, 80)
    for place in SLOTS if slot is not None else ():
        light[place] = slot
    light = cv2.GaussianBlur(light, (0, 0), 0.7) + np.random.default_rng(0).normal(0, 1.0, light.shape)
    return np.clip(light, 0, 255).astype(np.uint8), mask


def _share(slot: np.ndarray | None, network: np.ndarray | None = None) -> float:
    rgb, mask = _blade(slot)
    background = model_background(rgb)
    gradient = gradient_magnitude(background.lab)
    return enclosed_background_share(background, mask, gradient, edge_threshold(background, gradient), network)


@pytest.mark.parametrize("light", [1.0, 0.72])
def test_slots_that_show_the_ground_are_seen(light: float) -> None:
    assert _share(light * GROUND) > 0.02


def test_what_is_lit_unevenly_and_networks_are_sure_of_is_paint_and_no_hole() -> None:
    sure = np.full(SIZE, 0.97, np.float32)
    shaded = GROUND * np.linspace(1.0, 0.85, 60)[None, :, None]
    assert _share(shaded) > 0.02 and _share(shaded, 0.8 * sure) == _share(shaded)
    assert _share(shaded, sure) == 0.0
    assert _share(GROUND, sure) == _share(GROUND), "of slots that are lit as the ground is they know nothing"


def test_solid_blade_and_slots_of_another_tint_show_no_ground() -> None:
    assert _share(None) == 0.0
    assert _share(np.array([190.0, 150, 110])) == 0.0


def test_slots_in_deep_shade_are_cut_out_or_the_photo_is_rejected() -> None:
    rgb, mask = _blade(0.66 * GROUND)
    try:
        alpha = matte_photo(rgb, "blade.png").rgba[..., 3] > 127
    except Rejected as rejection:
        assert rejection.reason == "low_confidence_matte" and "seen through it" in rejection.detail
    else:
        assert not any(alpha[place].mean() > 0.3 for place in SLOTS)
        assert alpha.sum() > 0.7 * mask.sum()
