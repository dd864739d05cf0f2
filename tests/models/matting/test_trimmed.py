"""Photos that were trimmed to the thing: on one pure colour, with next to no ground around."""

import cv2
import numpy as np
import pytest

from manitwin.errors import Rejected
from manitwin.models.matting import matte_photo
from manitwin.models.matting.matte import TRIMMED
from manitwin.models.matting.trimmed import restore_margin, trimmed_margin

WHITE = np.array([255, 255, 255])


def _plum(side_px: int = 360, ground: int = 255) -> tuple[np.ndarray, np.ndarray]:
    """Return a picture (H, W, 3) of a plum on an even ground, and its mask."""
    rgb, mask = np.full((side_px, side_px, 3), ground, np.uint8), np.zeros((side_px, side_px), np.uint8)
    cv2.ellipse(mask, (180, 180), (110, 60), 30, 0, 360, 1, -1)
    shade = np.linspace(0.75, 1.05, side_px)[None, :, None]
    rgb[mask > 0] = np.clip(np.array([170, 60, 40]) * np.broadcast_to(shade, rgb.shape)[mask > 0], 0, 255).astype(
        np.uint8
    )
    return rgb, mask > 0


def _trimmed_to(rgb: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rows, columns = np.nonzero(mask.any(axis=1))[0], np.nonzero(mask.any(axis=0))[0]
    window = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return np.ascontiguousarray(rgb[window]), mask[window]


def test_a_photo_that_was_trimmed_to_the_thing_is_cut_out() -> None:
    rgb, mask = _trimmed_to(*_plum())
    matte = matte_photo(rgb, "plum.jpg")
    found = matte.rgba[..., 3] > 127
    assert matte.rgba.shape[:2] == rgb.shape[:2]
    assert (found & mask).sum() / (found | mask).sum() > 0.97
    assert TRIMMED in matte.findings
    assert np.array_equal(matte.rgba[..., :3], rgb)


def test_the_finding_is_that_of_trimmed_photos_alone() -> None:
    assert TRIMMED not in matte_photo(_plum()[0], "plum.jpg").findings


@pytest.mark.parametrize("side", [np.s_[:, :200], np.s_[170:], np.s_[:, 130:230]])
def test_what_the_frame_cuts_off_is_given_no_margin(side: tuple[slice, ...]) -> None:
    rgb = np.ascontiguousarray(_plum()[0][side])
    assert trimmed_margin(rgb) is None
    assert restore_margin(rgb)[0] is rgb
    with pytest.raises(Rejected):
        matte_photo(rgb, "part of a plum.jpg")


def test_the_ground_has_to_be_of_one_colour_to_the_level() -> None:
    rgb, _ = _trimmed_to(*_plum())
    assert trimmed_margin(rgb) is not None
    uneven = np.clip(rgb + np.random.default_rng(0).normal(0, 6, rgb.shape), 0, 255).astype(np.uint8)
    assert trimmed_margin(uneven) is None


def test_what_leaves_ground_on_every_side_is_left_as_it_is() -> None:
    rgb, _ = _plum()
    assert trimmed_margin(rgb) is None


def test_what_ends_close_to_the_frame_without_touching_it_is_given_more_of_a_white_ground_alone() -> None:
    for ground, given in ((255, True), (180, False)):
        rgb, mask = _plum(ground=ground)
        rows, columns = np.nonzero(mask.any(axis=1))[0], np.nonzero(mask.any(axis=0))[0]
        close = rgb[rows[0] - 60 : rows[-1] + 60, columns[0] - 10 : columns[-1] + 60]
        assert (trimmed_margin(np.ascontiguousarray(close)) is not None) == given


def test_the_margin_has_the_grounds_colour_and_the_photo_lies_in_its_middle() -> None:
    rgb, _ = _trimmed_to(*_plum())
    wider, margin_px = restore_margin(rgb)
    assert margin_px == round(0.08 * max(rgb.shape[:2]))
    assert np.array_equal(wider[margin_px:-margin_px, margin_px:-margin_px], rgb)
    assert (wider[:margin_px] == WHITE).all() and (wider[:, -margin_px:] == WHITE).all()
