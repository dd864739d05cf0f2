"""Pictures whose alpha channel cuts nothing out, by what their alpha is; nothing of the picture itself is looked at."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from manitwin.config import MattingConfig
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.pipeline.cutout import CUTOUT
from manitwin.pipeline.given_alpha import FRAMED, framed_picture, normalize_alpha
from manitwin.pipeline.item import Item
from manitwin.pipeline.photo import PhotoStage

HEIGHT, WIDTH = 360, 480
GROUND, BLUE = (214, 212, 208), (30, 60, 160)
INSIDE = np.s_[90:270, 150:330]


def photo_of_a_block() -> np.ndarray:
    """A blue block ``(360, 480, 3) uint8`` on a plain ground, in focus."""
    rgb = np.empty((HEIGHT, WIDTH, 3), np.uint8)
    rgb[:] = GROUND
    rgb[INSIDE] = BLUE
    return cv2.GaussianBlur(rgb, (3, 3), 0)


def with_alpha(rgb: np.ndarray, alpha: np.ndarray | int) -> np.ndarray:
    return np.dstack([rgb, np.broadcast_to(np.asarray(alpha, np.uint8), rgb.shape[:2])])


def with_bars(rgb: np.ndarray, bar_px: int, *, shade: int = 0, round_px: int = 0) -> np.ndarray:
    """A picture with bars of the opacity ``shade`` above and below, its corners cut off along circles of ``round_px``."""
    alpha = np.full(rgb.shape[:2], 255, np.uint8)
    if round_px:
        alpha[:] = 0
        right, bottom = WIDTH - 1 - round_px, HEIGHT - 1 - round_px
        for x, y in ((round_px, round_px), (right, round_px), (round_px, bottom), (right, bottom)):
            cv2.circle(alpha, (x, y), round_px, 255, -1)
        alpha[round_px : bottom + 1] = alpha[:, round_px : right + 1] = 255
    edges = ((bar_px, bar_px), (0, 0))
    return np.dstack([np.pad(rgb, (*edges, (0, 0))), np.pad(alpha, edges, constant_values=shade)])


def draft_of(pixels: np.ndarray, folder: Path, name: str | None) -> Draft:
    Image.fromarray(pixels).save(folder / "given.png")
    return Draft("t", Item(file=str(folder / "given.png"), name=name), seed=0)


def cut_out(pixels: np.ndarray, folder: Path, name: str | None = None) -> tuple[dict, np.ndarray]:
    """The field of the photo stage and the picture that it wrote."""
    field = PhotoStage(MattingConfig()).run(draft_of(pixels, folder, name), folder)["matte"]
    return field, np.asarray(Image.open(folder / "photo.png"))


def test_alpha_that_is_the_same_everywhere_cuts_nothing_out(tmp_path: Path) -> None:
    field, rgba = cut_out(with_alpha(photo_of_a_block(), 200), tmp_path)
    assert field["method"] != "alpha" and "its alpha channel is 200 of 255 everywhere: not used" in field["findings"]
    assert (rgba[..., 3] > 127).sum() == pytest.approx(180 * 180, rel=0.02)
    assert rgba[180, 240, :3] == pytest.approx(BLUE, abs=3)


def test_a_faint_cut_out_keeps_its_colours(tmp_path: Path) -> None:
    rgb = photo_of_a_block()
    rgb[INSIDE][:90] = (200, 40, 40)
    for most in (204, 110):
        alpha = np.zeros((HEIGHT, WIDTH), np.uint8)
        alpha[INSIDE] = most
        alpha[90:93, 150:153] = 0  # no upright rectangle
        alpha[90:140, 150] = 0
        alpha[100:200, 330:360] = most
        field, rgba = cut_out(with_alpha(rgb, alpha), tmp_path)
        assert field["method"] == "alpha" and any(f"reaches {most} of 255" in finding for finding in field["findings"])
        assert rgba[120, 240].tolist() == [200, 40, 40, 255] and rgba[230, 240].tolist() == [*BLUE, 255]


def test_an_empty_channel_stays_empty(tmp_path: Path) -> None:
    for most in (0, 9):
        pixels = with_alpha(photo_of_a_block(), 0)
        pixels[100, 100, 3] = most
        assert normalize_alpha(pixels)[0] is pixels
        with pytest.raises(Rejected, match="alpha channel is empty"):
            cut_out(pixels, tmp_path)


def test_a_photo_with_transparent_bars_is_cut_out_where_its_name_is_no_rectangle_s(tmp_path: Path) -> None:
    field, rgba = cut_out(with_bars(photo_of_a_block(), 60), tmp_path, "stapler")
    assert FRAMED in field["findings"] and field["method"] != "alpha"
    assert rgba.shape[:2] == (HEIGHT, WIDTH) and (rgba[..., 3] > 127).sum() == pytest.approx(180 * 180, rel=0.02)


def test_an_upright_rectangle_without_a_name_is_doubted_and_kept_to_be_looked_at(tmp_path: Path) -> None:
    for name, remedy in ((None, "name the object with --name"), ("thingamajig", "the priors have no 'thingamajig'")):
        with pytest.raises(Rejected, match="an upright rectangle") as caught:
            cut_out(with_bars(photo_of_a_block(), 60), tmp_path, name)
        assert caught.value.reason == "low_confidence_matte" and CUTOUT in caught.value.files
        assert remedy in caught.value.detail and "given.png" in caught.value.detail


def test_a_rectangle_that_is_named_a_book_is_one(tmp_path: Path) -> None:
    field, rgba = cut_out(with_bars(photo_of_a_block(), 60), tmp_path, "book")
    assert (field["method"], field["confidence"]) == ("alpha", 1.0)
    assert (rgba[..., 3] > 127).sum() == HEIGHT * WIDTH


@pytest.mark.parametrize("shade", [0, 120])
@pytest.mark.parametrize("round_px", [0, 8])
def test_windows_have_small_round_corners_and_shadows(shade: int, round_px: int) -> None:
    inside = framed_picture(with_bars(photo_of_a_block(), 40, shade=shade, round_px=round_px))
    assert inside is not None and (inside == photo_of_a_block()).all()


def test_what_has_another_outline_or_no_bars_frames_nothing() -> None:
    rgb = photo_of_a_block()
    disc = np.zeros((HEIGHT, WIDTH), np.uint8)
    cv2.circle(disc, (240, 180), 150, 255, -1)
    for pixels in (rgb, with_alpha(rgb, 255), with_alpha(rgb, disc), with_bars(rgb, 40, round_px=90)):
        assert framed_picture(pixels) is None
