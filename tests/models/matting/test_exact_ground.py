"""On a ground of one digital colour, what has another colour than it and its shades is no ground, whatever the network sees."""

import cv2
import numpy as np
import pytest

from manitwin.models.matting import matte_photo, study
from manitwin.models.matting.matte import DoubtfulMatte
from manitwin.models.matting.trimmed import uniform_background_colour

SIDE_PX = 400


def _apple(noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a picture (H, W, 3) uint8 of a green apple on white, as noisy as said, and its mask."""
    mask = cv2.circle(np.zeros((SIDE_PX, SIDE_PX), np.uint8), (200, 210), 120, 1, -1)
    mask = cv2.line(mask, (200, 95), (215, 50), 1, 9)
    scene = np.full((SIDE_PX, SIDE_PX, 3), 250.0) + np.random.default_rng(0).normal(
        0, max(noise, 1e-9), (SIDE_PX, SIDE_PX, 3)
    )
    shade = np.linspace(1.1, 0.8, SIDE_PX)[:, None, None]
    scene = np.where(mask[..., None] > 0, np.array([160.0, 190.0, 50.0]) * shade, scene)
    return np.clip(cv2.GaussianBlur(scene, (0, 0), 0.7), 0, 255).astype(np.uint8), mask > 0


@pytest.fixture(autouse=True)
def _blind(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the network see the stem alone, as it does of fruit that somebody cut out."""
    stem = np.where(np.arange(SIDE_PX)[:, None] < 90, _apple(0)[1], False).astype(np.float32)
    monkeypatch.setattr(study, "network_share", lambda *_: stem)


def test_an_apple_is_cut_out_of_exact_white_though_the_network_sees_its_stem_alone() -> None:
    rgb, truth = _apple(noise=0)
    assert uniform_background_colour(rgb) is not None
    matte = matte_photo(rgb, "apple.jpg")
    found = matte.rgba[..., 3] > 127
    assert (found & truth).sum() / (found | truth).sum() > 0.97


def test_on_a_photographed_ground_the_network_is_listened_to() -> None:
    rgb, _ = _apple(noise=6)
    assert uniform_background_colour(rgb) is None
    with pytest.raises(DoubtfulMatte, match="do not agree"):
        matte_photo(rgb, "apple.jpg")


def test_a_shadow_on_exact_white_is_no_part() -> None:
    rgb, truth = _apple(noise=0)
    soft = cv2.GaussianBlur(
        cv2.ellipse(np.zeros((SIDE_PX, SIDE_PX)), (230, 330), (120, 18), 0, 0, 360, 0.3, -1), (0, 0), 9
    )
    shaded = np.where(truth[..., None], rgb, rgb * (1 - soft[..., None])).astype(np.uint8)
    assert uniform_background_colour(shaded) is not None
    try:
        matte = matte_photo(shaded, "apple.jpg")
    except DoubtfulMatte as doubted:
        matte = doubted.matte
    found = matte.rgba[..., 3] > 127
    assert (found & ~truth).sum() < 0.01 * truth.sum()
