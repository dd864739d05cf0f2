from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from manitwin.errors import UsageError
from manitwin.render.contact_sheet import CAPTION_PX, GAP_PX, TILE_PX, contact_sheet
from manitwin.scenes.layouts.layouts_run import CONTACT_SHEET, make_layouts
from manitwin.scenes.layouts.scenes_sheet import write_contact_sheet
from manitwin.scenes.settings import LayoutsConfig, LayoutSettings
from scene_twins import slab, write_things


def tile(shade: int) -> np.ndarray:
    return np.full((TILE_PX, TILE_PX, 3), shade, np.uint8)


@pytest.mark.parametrize(("count", "columns", "rows"), [(1, 2, 1), (6, 3, 2), (48, 8, 6)])
def test_pictures_stand_row_by_row_with_their_captions_below(count: int, columns: int, rows: int) -> None:
    page = np.asarray(contact_sheet([(f"scene_{n}", tile(5 * n)) for n in range(count)]))
    width, height = TILE_PX + GAP_PX, TILE_PX + CAPTION_PX + GAP_PX
    assert page.shape == (rows * height + GAP_PX, columns * width + GAP_PX, 3)
    for number in range(count):
        x, y = GAP_PX + number % columns * width, GAP_PX + number // columns * height
        assert (page[y : y + TILE_PX, x : x + TILE_PX] == 5 * number).all()
        assert (page[y + TILE_PX : y + TILE_PX + CAPTION_PX, x : x + TILE_PX] < 100).any()


def test_first_scenes_of_a_run_are_shown_the_same_each_time(tmp_path: Path) -> None:
    write_things(tmp_path / "twins", (slab("box", 0.1, 0.1, 0.1),))
    out = tmp_path / "out"
    config = LayoutsConfig(layout=LayoutSettings(objects=(1, 1)))
    make_layouts(tmp_path / "twins", out, 3, config, executor="inline")
    assert write_contact_sheet(tmp_path / "twins", out, most=2) == 2
    first = (out / CONTACT_SHEET).read_bytes()
    with Image.open(out / CONTACT_SHEET) as image:
        page = np.asarray(image.convert("RGB"))
    left, right = (page[GAP_PX:][:TILE_PX, x:][:, :TILE_PX].astype(int) for x in (GAP_PX, 2 * GAP_PX + TILE_PX))
    assert left.std() > 10 and np.abs(left - right).mean() > 3  # two scenes, not one twice
    write_contact_sheet(tmp_path / "twins", out, most=2)
    assert (out / CONTACT_SHEET).read_bytes() == first
    assert write_contact_sheet(tmp_path / "twins", out) == 3


@pytest.mark.parametrize("content", [b"", b"RIFF", b"hello", b"\x89PNG\r\n\x1a\n" + bytes(40)])
def test_drawn_picture_that_cannot_be_read_is_said(content: bytes, tmp_path: Path) -> None:
    write_things(tmp_path / "twins", (slab("box", 0.1, 0.1, 0.1),))
    config = LayoutsConfig(layout=LayoutSettings(objects=(1, 1)))
    make_layouts(tmp_path / "twins", tmp_path / "out", 1, config, executor="inline")
    (scene,) = tmp_path.glob("out/scenes/*/*")
    (scene / "pictures").mkdir()
    (scene / "pictures/oblique_rgb.webp").write_bytes(content)
    with pytest.raises(UsageError, match=r"oblique_rgb\.webp: not a readable picture; remove the folder of its scene"):
        write_contact_sheet(tmp_path / "twins", tmp_path / "out")
    assert not (tmp_path / "out" / CONTACT_SHEET).exists()


def test_run_without_an_accepted_scene_has_no_sheet(tmp_path: Path) -> None:
    write_things(tmp_path / "twins", (slab("board", 0.5, 0.5, 0.015),))
    config = LayoutsConfig(layout=LayoutSettings(objects=(3, 3), surface="tray"))
    make_layouts(tmp_path / "twins", tmp_path / "out", 1, config, executor="inline")
    with pytest.raises(UsageError, match="no accepted scene to show"):
        write_contact_sheet(tmp_path / "twins", tmp_path / "out")
    assert not (tmp_path / "out" / CONTACT_SHEET).exists()
