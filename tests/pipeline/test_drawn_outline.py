"""An outline that a person drew is what a photo is cut out by, whatever is seen in it otherwise."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from manitwin.config import MattingConfig
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.pipeline.drawn_masks import with_drawn_masks
from manitwin.pipeline.drawn_outline import (
    DRAWN,
    DRAWN_OF_SEVERAL,
    DrawnOutline,
    cut_by_outline,
    drawn_outline,
    mask_file,
    mask_of_png,
    with_outline,
)
from manitwin.pipeline.given_alpha import CutOutInput
from manitwin.pipeline.item import Item
from manitwin.pipeline.photo import PhotosStage, PhotoStage


def ellipse(height: int, width: int) -> np.ndarray:
    rows, columns = np.mgrid[:height, :width]
    return np.asarray(((rows / height - 0.5) / 0.3) ** 2 + ((columns / width - 0.5) / 0.2) ** 2 < 1)


def png(picture: Image.Image) -> bytes:
    encoded = io.BytesIO()
    picture.save(encoded, "PNG")
    return encoded.getvalue()


def test_kept_outline_is_read_as_it_was_drawn() -> None:
    drawn = DrawnOutline(ellipse(200, 300), "human:ada")
    read = drawn_outline({DRAWN: drawn.to_json()}, "a.jpg")
    assert read is not None and read.source == "human:ada" and (read.mask == drawn.mask).all()
    assert len(drawn.to_json()["png"]) < 2000 and drawn_outline({}, "a.jpg") is None


@pytest.mark.parametrize(
    "said",
    [
        {"png": "####", "source": "human:ada"},
        {"png": base64.b64encode(b"no picture").decode(), "source": "human:ada"},
        {"png": base64.b64encode(png(Image.new("1", (1025, 8)))).decode(), "source": "human:ada"},
        {"source": "human:ada"},
        "mask.png",
    ],
)
def test_what_is_no_outline_is_refused_and_not_passed_over(said: Any) -> None:
    with pytest.raises(Rejected, match=r"a\.jpg: its drawn outline cannot be read; remove its file"):
        drawn_outline({DRAWN: said}, "a.jpg")


def test_png_of_another_kind_is_none() -> None:
    jpeg = io.BytesIO()
    Image.new("L", (64, 64)).save(jpeg, "JPEG")
    for data in (jpeg.getvalue(), png(Image.new("L", (64, 64)))[:40], b""):
        with pytest.raises(ValueError, match="no PNG file"):
            mask_of_png(data)
    grey = np.tile(np.arange(256, dtype=np.uint8), (64, 1))
    assert (mask_of_png(png(Image.fromarray(grey))) == (grey > 127)).all()


def test_outline_is_scaled_to_its_picture_and_goes_before_the_pictures_own_alpha() -> None:
    pixels = np.full((400, 600, 4), 90, np.uint8)
    given = cut_by_outline(
        CutOutInput(pixels, ("another",), is_doubted=True), DrawnOutline(ellipse(200, 300), "human:ada"), "a.png"
    )
    assert given.pixels.shape == (400, 600, 4) and not given.is_doubted
    assert ((given.pixels[..., 3] > 127) == ellipse(400, 600)).mean() > 0.99
    assert given.findings == ("cut out as human:ada drew its outline",)


def test_outline_of_other_proportions_an_empty_one_and_a_full_one_are_refused() -> None:
    given = CutOutInput(np.zeros((400, 600, 3), np.uint8))
    for mask, why in (
        (ellipse(300, 300), "drew the outline on another picture"),
        (np.zeros((200, 300), bool), "is empty"),
        (np.ones((200, 300), bool), "covers the whole photo"),
    ):
        with pytest.raises(Rejected, match=why):
            cut_by_outline(given, DrawnOutline(mask, "human:ada"), "a.png")


def test_outline_as_a_mask_of_the_whole_photo_lies_where_it_was_drawn() -> None:
    drawn = DrawnOutline(ellipse(200, 300), "human:ada")
    whole = mask_file(drawn, (600, 400), None)
    assert whole is not None and (mask_of_png_of_any_size(whole) == ellipse(400, 600)).mean() > 0.99
    box = (300.0, 100.0, 500.0, 300.0)  # with a margin of 30 pixels
    square = mask_file(DrawnOutline(ellipse(130, 130), "human:ada"), (1600, 400), box)
    assert square is not None
    mask = mask_of_png_of_any_size(square)
    assert mask.shape == (400, 1600) and (mask[70:330, 270:530] == ellipse(260, 260)).mean() > 0.99
    mask[70:330, 270:530] = False
    assert not mask.any()
    assert mask_file(drawn, (600, 600), None) is None


def mask_of_png_of_any_size(data: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(data)).convert("L")) > 127


@pytest.mark.parametrize("box_px", [pytest.param((), marks=pytest.mark.slow), (100.0, 100.0, 500.0, 500.0)])
def test_photo_that_shows_nothing_is_cut_out_as_drawn(tmp_path: Path, box_px: tuple[float, ...]) -> None:
    grain = np.random.default_rng(0).integers(120, 136, (600, 600, 3), np.uint8)
    Image.fromarray(grain).save(tmp_path / "pale.png")
    item = Item(str(tmp_path / "pale.png"), "bottle", box_px=box_px)
    with pytest.raises(Rejected):
        PhotoStage(MattingConfig()).run(Draft("t", item, seed=0), tmp_path)
    said = {PhotoStage.name: {DRAWN: DrawnOutline(ellipse(300, 300), "human:ada").to_json()}}
    field = PhotoStage(MattingConfig()).run(Draft("t", item, seed=0, amendments=said), tmp_path)["matte"]
    alpha = np.asarray(Image.open(tmp_path / "photo.png"))[..., 3] > 127
    assert (alpha == ellipse(*alpha.shape)).mean() > 0.99
    assert field["method"] == "alpha" and "cut out as human:ada drew its outline" in field["findings"]


def test_outlines_of_several_photos_are_kept_by_their_places() -> None:
    front, side = DrawnOutline(ellipse(200, 300), "human:ada"), DrawnOutline(ellipse(300, 200), "human:ben")
    said = with_outline(with_outline({"other": 1}, front, 0), side, 11)
    assert set(said) == {"other", DRAWN_OF_SEVERAL} and set(said[DRAWN_OF_SEVERAL]) == {"0", "11"}
    read = drawn_outline(said, "side.jpg", 11)
    assert read is not None and read.source == "human:ben" and drawn_outline(said, "back.jpg", 1) is None
    assert drawn_outline(said, "a.jpg") is None, "one of a photo by itself is another"
    with pytest.raises(Rejected, match=r"a\.jpg: its drawn outline cannot be read"):
        drawn_outline({DRAWN_OF_SEVERAL: ["no object"]}, "a.jpg", 0)


def test_each_of_several_photos_is_cut_out_as_drawn_and_one_that_is_not_is_left_out(tmp_path: Path) -> None:
    files = [str(tmp_path / name) for name in ("front.png", "side.png", "back.png")]
    for seed, file in enumerate(files):
        Image.fromarray(np.random.default_rng(seed).integers(120, 136, (600, 600, 3), np.uint8)).save(file)
    item = Item(files[0], name="bottle", views=tuple(files[1:]), turns_deg=(0.0, 90.0, 180.0))
    said: dict[str, Any] = with_outline({}, DrawnOutline(ellipse(300, 300), "human:ada"), 1)
    said[DRAWN_OF_SEVERAL]["2"] = "mask.png"
    field = PhotosStage(MattingConfig()).run(Draft("t", item, seed=0, amendments={PhotosStage.name: said}), tmp_path)[
        "matte"
    ]
    assert [picture.name for picture in (tmp_path / "photos").iterdir()] == ["01.png"]
    alpha = np.asarray(Image.open(tmp_path / "photos" / "01.png"))[..., 3] > 127
    assert (alpha == ellipse(600, 600)).mean() > 0.99
    assert "side.png: cut out as human:ada drew its outline" in field["findings"]
    assert any(each.startswith("left out: back.png: its drawn outline") for each in field["findings"])


def test_drawn_outlines_of_several_photos_take_the_places_of_their_masks(tmp_path: Path) -> None:
    files = [str(tmp_path / name) for name in ("front.png", "side.png", "back.png")]
    for file in files:
        Image.new("RGB", (600, 400)).save(file)
    item = Item(files[0], name="bottle", views=tuple(files[1:]), masks=("given_0.png", "", "given_2.png"))
    drawn = with_outline({}, DrawnOutline(ellipse(200, 300), "human:ada"), 0)
    drawn = with_outline(drawn, DrawnOutline(ellipse(300, 300), "human:ada"), 2)  # of another picture
    masked = with_drawn_masks(Draft("t", item, seed=0, amendments={PhotosStage.name: drawn}), tmp_path)
    assert masked.masks == (str(tmp_path / "drawn_00.png"), "", "given_2.png")
    assert (mask_of_png_of_any_size(Path(masked.masks[0]).read_bytes()) == ellipse(400, 600)).mean() > 0.99
    assert with_drawn_masks(Draft("t", item, seed=0), tmp_path) == item
