"""Small photos: colours follow the edges of light, and outlines are finer than pixels."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.models.matting import matte_photo
from manitwin.models.matting.upsampling import enlarge_photo, sharpen_chroma

GROUND, THING = (196, 192, 186), (120, 60, 58)


def _scene(side_px: int, noise: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """A lying ellipse on a pale ground, with noise in grey values: ``rgb`` (S, S, 3) uint8, and its mask."""
    mask = np.zeros((side_px, side_px), np.uint8)
    middle = (side_px // 2, side_px // 2)
    cv2.ellipse(mask, middle, (round(0.32 * side_px), round(0.09 * side_px)), 25, 0, 360, 1, -1, cv2.LINE_AA)
    rgb = np.where(mask[..., None] > 0, np.array(THING, float), np.array(GROUND, float))
    rgb += np.random.default_rng(0).normal(0, noise, rgb.shape)
    return np.clip(cv2.GaussianBlur(rgb, (0, 0), 0.7), 0, 255).astype(np.uint8), mask > 0


def _compressed(rgb: np.ndarray) -> np.ndarray:
    """As JPEG of quality 65, colours at half the resolution."""
    encoded = cv2.imencode(".jpg", rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 65])[1]
    return np.ascontiguousarray(cv2.imdecode(encoded, cv2.IMREAD_COLOR)[..., ::-1])


def _colour_error(rgb: np.ndarray, true: np.ndarray) -> float:
    """The mean difference of the colour difference channels, in grey values."""
    one, other = (cv2.cvtColor(each, cv2.COLOR_RGB2YCrCb)[..., 1:].astype(float) for each in (rgb, true))
    return float(np.abs(one - other).mean())


def test_a_photo_of_working_size_is_left_as_it_is() -> None:
    rgb, _ = _scene(512)
    assert enlarge_photo(rgb, 512) is rgb


@pytest.mark.parametrize("shape", [(256, 192), (100, 256), (511, 20)])
def test_the_longer_side_of_a_small_photo_becomes_the_working_size(shape: tuple[int, int]) -> None:
    seen = enlarge_photo(np.full((*shape, 3), 90, np.uint8), 512)
    assert max(seen.shape[:2]) == 512 and seen.shape[2] == 3
    assert seen.shape[0] / seen.shape[1] == pytest.approx(shape[0] / shape[1], rel=0.05)
    assert (seen == 90).all()


def test_colours_that_compression_smeared_return_to_the_edges_of_light() -> None:
    rgb, _ = _scene(256, noise=0.0)
    smeared = _compressed(rgb)
    assert _colour_error(sharpen_chroma(smeared), rgb) < 0.75 * _colour_error(smeared, rgb)


def test_the_matte_of_a_small_compressed_photo_has_its_size_and_a_true_outline() -> None:
    rgb, truth = _scene(256)
    matte = matte_photo(_compressed(rgb), "small.jpg")
    assert matte.rgba.shape == (256, 256, 4)
    found = matte.rgba[..., 3] > 127
    assert (found & truth).sum() / (found | truth).sum() > 0.97
