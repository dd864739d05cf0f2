"""Where in a photo the thing is, as it is stated: boxes and masks of single photos, of rows and of groups."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from manitwin.config import MattingConfig
from manitwin.engine.stage import Draft
from manitwin.errors import InputError, Rejected, UsageError
from manitwin.formats.outline_mask import read_mask
from manitwin.geometry.pixel_boxes import box_of_pixels, crop_to_image_box, image_to_crop_box, intersection_over_union
from manitwin.pipeline.assembly import _write_source
from manitwin.pipeline.item import Item, twin_id
from manitwin.pipeline.manifest import Notes, iterate_items
from manitwin.pipeline.photo import PhotosStage, PhotoStage
from manitwin.pipeline.stated_place import stated_box_px, window_of

WIDTH, HEIGHT = 640, 360
RED, BLUE = (170, 186, 100), (450, 170, 80)
"""Discs: x, y and radius."""


def _disc(x: float, y: float, radius: float) -> np.ndarray:
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    return np.hypot(columns + 0.5 - x, rows + 0.5 - y) < radius


def _two_things(folder: Path) -> Path:
    """Write a photo of a red and a blue disc on grey paper, and masks of the red one, of both and with numbers."""
    rng = np.random.default_rng(3)
    picture = np.full((HEIGHT, WIDTH, 3), 190.0) + rng.normal(0, 1.5, (HEIGHT, WIDTH, 1))
    picture[_disc(*RED)] = (180, 40, 30)
    picture[_disc(*BLUE)] = (30, 60, 170)
    Image.fromarray(np.clip(picture, 0, 255).astype(np.uint8)).save(folder / "two.png")
    Image.fromarray((255 * _disc(*RED)).astype(np.uint8)).save(folder / "red.png")
    Image.fromarray((_disc(*RED) + 2 * _disc(*BLUE)).astype(np.uint8)).save(folder / "numbers.png")
    return folder / "two.png"


def _around(x: float, y: float, radius: float) -> tuple[float, float, float, float]:
    return x - radius, y - radius, x + radius, y + radius


def _rows(folder: Path, *rows: dict[str, Any], name: str = "rows.jsonl") -> list[Item]:
    (folder / name).write_text("".join(json.dumps(row) + "\n" for row in rows))
    return list(iterate_items([folder / name], {}, Notes()))


def _cut(item: Item, folder: Path, settings: MattingConfig | None = None) -> tuple[np.ndarray, dict[str, Any]]:
    folder.mkdir()
    field = PhotoStage(settings or MattingConfig()).run(Draft("t", item, seed=0), folder)["matte"]
    return np.asarray(Image.open(folder / "photo.png")), field


@pytest.mark.parametrize(
    "said", ["12,8,41,39.5", "12 8 41 39.5", " [12, 8, 41, 39.5] ", (12, 8, 41, 39.5), [12, 8, 41, 39.5]]
)
def test_a_box_is_four_numbers(said: object) -> None:
    assert stated_box_px(said, "here") == (12, 8, 41, 39.5)


@pytest.mark.parametrize("said", ["", None])
def test_no_box_is_said(said: object) -> None:
    assert stated_box_px(said, "here") is None


@pytest.mark.parametrize("said", ["1,2,3", "a,b,c,d", "1,2,nan,4", "1,2,inf,4", 7, {"x": 1}, [1, 2, 3, [4]]])
def test_what_is_no_box(said: object) -> None:
    with pytest.raises(UsageError, match=r"here: box_px is .*; give left,top,right,bottom in pixels"):
        stated_box_px(said, "here")


def test_a_width_and_a_height_are_no_edges() -> None:
    with pytest.raises(UsageError, match=r"not a width and a height"):
        stated_box_px("350,120,100,60", "here")


def test_the_window_has_a_margin_and_ends_with_the_photo() -> None:
    assert window_of((100, 100, 200, 150), (640, 360), "a.png") == (85, 85, 215, 165)
    assert window_of((-1, 0, 200, 360.5), (640, 360), "a.png") == (0, 0, 255, 360)


@pytest.mark.parametrize("box", [(-20.0, 0.0, 100.0, 100.0), (0.0, 0.0, 700.0, 100.0), (0.0, 0.0, 100.0, 380.0)])
def test_a_box_outside_the_photo(box: tuple[float, float, float, float]) -> None:
    with pytest.raises(InputError, match=r"a\.png: the box .* lies outside the photo, which is 640 x 360 pixels"):
        window_of(box, (640, 360), "a.png")


@pytest.mark.parametrize("box", [(0.0, 0.0, 30.0, 30.0), (0.0, 0.0, 200.0, 4.0)])
def test_a_box_of_next_to_nothing(box: tuple[float, float, float, float]) -> None:
    with pytest.raises(InputError, match=r"its longer side must have at least 32"):
        window_of(box, (640, 360), "a.png")


def test_a_box_chooses_one_of_two_things(tmp_path: Path) -> None:
    photo = _two_things(tmp_path)
    told = r"2 separate objects; say where one is \(--box \d+,\d+,\d+,28\d or --box 3\d\d,.*\), or crop"
    with pytest.raises(Rejected, match=told):
        _cut(Item(str(photo)), tmp_path / "both")
    for number, (disc, box) in enumerate(((RED, _around(*RED)), (BLUE, _around(*BLUE)))):
        rgba, field = _cut(Item(str(photo), box_px=box), tmp_path / str(number))
        left, top, right, bottom = window_of(box, (WIDTH, HEIGHT), "")
        assert rgba.shape[:2] == (bottom - top, right - left)
        truth = _disc(*disc)[top:bottom, left:right]
        found = rgba[..., 3] > 127
        assert (found & truth).sum() / (found | truth).sum() > 0.97
        assert "looked at within the box that was stated of it" in field["findings"]


def test_a_box_around_other_things_is_told(tmp_path: Path) -> None:
    photo = _two_things(tmp_path)
    left, top, right, bottom = _around(*RED)
    with pytest.raises(Rejected, match=r"two\.png: the cut-out and the stated box overlap by only \d+ %"):
        _cut(Item(str(photo), box_px=(left - 50, top - 40, right + 30, bottom + 30)), tmp_path / "cut")


def test_a_large_photo_keeps_its_pixels_in_the_box(tmp_path: Path) -> None:
    photo, settings = _two_things(tmp_path), MattingConfig(photo_side_px=256)
    rgba, _ = _cut(Item(str(photo), box_px=_around(*BLUE)), tmp_path / "cut", settings)
    assert max(rgba.shape[:2]) == round(1.3 * 160) < settings.photo_side_px < WIDTH


def test_the_lens_is_that_of_the_window(tmp_path: Path) -> None:
    photo = Image.open(_two_things(tmp_path))
    exif = photo.getexif()
    exif[0x8769] = {0xA405: 28}  # FocalLengthIn35mmFilm
    photo.save(tmp_path / "lens.jpg", quality=98, exif=exif)
    box = _around(*RED)
    whole = _cut_focal(Item(str(tmp_path / "lens.jpg"), masks=(str(tmp_path / "red.png"),)), tmp_path / "a")
    window = _cut_focal(Item(str(tmp_path / "lens.jpg"), box_px=box), tmp_path / "b")
    left, top, right, bottom = window_of(box, (WIDTH, HEIGHT), "")
    assert whole == 28
    assert window == pytest.approx(28 * np.hypot(WIDTH, HEIGHT) / np.hypot(right - left, bottom - top))


def _cut_focal(item: Item, folder: Path) -> float:
    focal = _cut(item, folder)[1]["focal_mm"]
    assert isinstance(focal, float | int)
    return float(focal)


def test_a_mask_is_believed(tmp_path: Path) -> None:
    photo = _two_things(tmp_path)
    rgba, field = _cut(Item(str(photo), masks=(str(tmp_path / "red.png"),)), tmp_path / "cut")
    assert field["method"] == "alpha" and np.array_equal(rgba[..., 3] > 127, _disc(*RED))
    boxed, _ = _cut(Item(str(photo), masks=(str(tmp_path / "red.png"),), box_px=_around(*RED)), tmp_path / "boxed")
    left, top, right, bottom = window_of(_around(*RED), (WIDTH, HEIGHT), "")
    assert np.array_equal(boxed[..., 3] > 127, _disc(*RED)[top:bottom, left:right])


def test_a_mask_that_numbers_things(tmp_path: Path) -> None:
    photo = _two_things(tmp_path)
    with pytest.raises(InputError, match=r"numbers\.png: a mask of several levels \(1, 2\)"):
        _cut(Item(str(photo), masks=(str(tmp_path / "numbers.png"),)), tmp_path / "cut")


def test_a_mask_of_one_colour_is_one(tmp_path: Path) -> None:
    red = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    red[_disc(*RED)] = 192, 0, 0
    smooth = Image.fromarray(red).resize((2 * WIDTH, 2 * HEIGHT), Image.Resampling.BICUBIC)
    smooth.save(tmp_path / "red.png")
    mask = read_mask(tmp_path / "red.png", (2 * HEIGHT, 2 * WIDTH))
    assert (mask > 127).sum() == pytest.approx(4 * _disc(*RED).sum(), rel=0.01)
    red[_disc(*BLUE)] = 0, 0, 128
    Image.fromarray(red).save(tmp_path / "both.png")
    with pytest.raises(InputError, match=r"both\.png: a mask with several colours; give one that is white"):
        read_mask(tmp_path / "both.png", (HEIGHT, WIDTH))


@pytest.mark.parametrize("quality", [30, 75, 95])
def test_a_mask_with_losses_and_smooth_edges_is_one(tmp_path: Path, quality: int) -> None:
    smooth = Image.fromarray((255 * _disc(*RED)).astype(np.uint8)).resize(
        (2 * WIDTH, 2 * HEIGHT), Image.Resampling.BICUBIC
    )
    smooth.save(tmp_path / "mask.jpg", quality=quality)
    mask = read_mask(tmp_path / "mask.jpg", (2 * HEIGHT, 2 * WIDTH))
    assert (mask > 127).sum() == pytest.approx(4 * _disc(*RED).sum(), rel=0.01)


def test_a_mask_of_another_size(tmp_path: Path) -> None:
    photo = _two_things(tmp_path)
    Image.open(tmp_path / "red.png").resize((320, 180)).save(tmp_path / "half.png")
    with pytest.raises(InputError, match=r"half\.png: a mask of 320 x 180 pixels, and its photo has 640 x 360"):
        _cut(Item(str(photo), masks=(str(tmp_path / "half.png"),)), tmp_path / "cut")


def test_rows_say_masks_and_boxes(tmp_path: Path) -> None:
    _two_things(tmp_path)
    items = _rows(
        tmp_path,
        {"file": "two.png", "box_px": "70,86,270,286"},
        {"file": "two.png", "box_px": "370,90,530,250"},
        {"file": "two.png", "mask": "red.png"},
        {"file": "two.png"},
    )
    assert [item.box_px for item in items] == [(70, 86, 270, 286), (370, 90, 530, 250), (), ()]
    assert [item.masks for item in items] == [(), (), (str(tmp_path / "red.png"),), ()]
    assert len({twin_id(item) for item in items}) == 4
    assert [item.title for item in items[:3]] == [
        "two.png (box 70,86,270,286)",
        "two.png (box 370,90,530,250)",
        "two.png",
    ]
    assert [Item.from_json(json.loads(json.dumps(item.to_json()))) for item in items] == items
    assert "box_px" not in items[3].to_json() and "masks" not in items[3].to_json()


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ({"file": "two.png", "mask": "gone.png"}, r"rows\.jsonl:1: mask: .*gone\.png is not a file"),
        ({"file": "cube.obj", "mask": "red.png"}, r"mask: applies to photos, but this is a mesh"),
        (
            {"text": "a red mug", "box_px": "1,2,30,40"},
            r"box_px: applies to photos, but this is a text",
        ),
        ({"file": "two.png", "mask": "a\0b"}, r"mask: contains a NUL character"),
        ({"file": "two.png", "box_px": "1,2,3"}, r"rows\.jsonl:1: box_px is 1,2,3; give"),
    ],
)
def test_rows_that_say_them_wrongly(tmp_path: Path, row: dict[str, str], said: str) -> None:
    _two_things(tmp_path)
    (tmp_path / "cube.obj").write_text("v 0 0 0\n")
    with pytest.raises(UsageError, match=said):
        _rows(tmp_path, row)


@pytest.mark.parametrize("more", [["two.png"], ["."], ["rows.csv"], []])
def test_what_holds_for_all_is_of_one_photo(tmp_path: Path, more: list[str]) -> None:
    photo = _two_things(tmp_path)
    (tmp_path / "rows.csv").write_text("file\ntwo.png\n")
    inputs = [photo, *(tmp_path / name for name in more)] if more in (["two.png"], []) else [tmp_path / more[0]]
    texts = [] if more else ["a mug"]
    with pytest.raises(UsageError, match="a mask or a box applies to one photo; for several photos write a manifest"):
        list(iterate_items(inputs, {"box_px": "70,86,270,286"}, Notes(), texts))
    (item,) = iterate_items([photo], {"box_px": (70, 86, 270, 286), "mask": tmp_path / "red.png"}, Notes())
    assert item.box_px == (70, 86, 270, 286) and item.masks == (str(tmp_path / "red.png"),)


def test_photos_of_a_group_have_masks_of_their_own(tmp_path: Path) -> None:
    _two_things(tmp_path)
    Image.open(tmp_path / "two.png").transpose(Image.Transpose.FLIP_LEFT_RIGHT).save(tmp_path / "other.png")
    Image.open(tmp_path / "red.png").transpose(Image.Transpose.FLIP_LEFT_RIGHT).save(tmp_path / "other_red.png")
    (item,) = _rows(
        tmp_path,
        {"file": "two.png", "group": "g", "mask": "red.png", "turn_deg": 0, "name": "ball"},
        {"file": "other.png", "group": "g", "mask": "other_red.png", "turn_deg": 90},
    )
    assert item.masks == (str(tmp_path / "red.png"), str(tmp_path / "other_red.png"))
    folder = tmp_path / "draft"
    folder.mkdir()
    PhotosStage(MattingConfig()).run(Draft("t", item, seed=0), folder)
    second = np.asarray(Image.open(folder / "photos" / "01.png"))[..., 3] > 127
    assert np.array_equal(second, _disc(*RED)[:, ::-1])
    source = _write_source(Draft("t", item, seed=0), "photos", folder, keep=True)
    assert source["mask"] is None
    assert zipfile.ZipFile(folder / "source.zip").namelist() == [
        *("photo_00.png", "photo_01.png", "mask_00.png", "mask_01.png")
    ]
    (bare,) = _rows(
        tmp_path, {"file": "two.png", "group": "g", "name": "ball"}, {"file": "other.png", "group": "g"}, name="b.jsonl"
    )
    assert twin_id(bare) != twin_id(item)


def test_a_box_in_a_group(tmp_path: Path) -> None:
    _two_things(tmp_path)
    Image.open(tmp_path / "two.png").rotate(180).save(tmp_path / "other.png")
    with pytest.raises(UsageError, match=r"group 'g' \(rows 1, 2\): box_px applies to a single photo"):
        _rows(
            tmp_path,
            {"file": "two.png", "group": "g", "box_px": "70,86,270,286"},
            {"file": "other.png", "group": "g"},
        )


def test_a_twin_keeps_them(tmp_path: Path) -> None:
    photo = _two_things(tmp_path)
    item = Item(str(photo), masks=(str(tmp_path / "red.png"),), box_px=_around(*RED))
    folder = tmp_path / "twin"
    folder.mkdir()
    source = _write_source(Draft("t", item, seed=0), "image", folder, keep=True)
    assert (source["file"], source["mask"], source["box_px"]) == ("source.png", "source_mask.png", list(_around(*RED)))
    assert (folder / "source_mask.png").read_bytes() == (tmp_path / "red.png").read_bytes()
    other = tmp_path / "reference"
    other.mkdir()
    assert _write_source(Draft("t", item, seed=0), "image", other, keep=False)["mask"] is None
    lines = (other / "source.txt").read_text().splitlines()
    assert [line.split(":")[0] for line in lines] == ["two.png", "source_mask.png"]


def test_boxes_in_common() -> None:
    assert box_of_pixels(_disc(*RED)) == _around(*RED)
    assert intersection_over_union((0, 0, 10, 10), (5, 0, 15, 10)) == pytest.approx(1 / 3)
    assert intersection_over_union((0, 0, 10, 10), (20, 0, 30, 10)) == 0


def test_boxes_of_a_window_and_back() -> None:
    assert image_to_crop_box((120, 80, 160, 90), (100, 60, 300, 260), 0.5) == (10, 10, 30, 15)
    assert crop_to_image_box((10, 10, 30, 15), (100, 60, 300, 260), (0.5, 0.5)) == (120, 80, 160, 90)
