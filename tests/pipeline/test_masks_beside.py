"""Masks of photos in a folder, told by their names: parts of their photos, which are cut out by them."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from manitwin.pipeline.folder_listing import list_folder
from manitwin.pipeline.manifest import Notes, iterate_items
from manitwin.pipeline.mask_matching import match_masks


@pytest.mark.parametrize("mask", ["mug_mask.png", "mug-mask.jpg", "mug.mask.png", "mug_MASK.webp"])
def test_a_name_tells_a_mask(mask: str) -> None:
    assert match_masks(["mug.jpg", mask]) == {mask: "mug.jpg"}
    assert match_masks(["a/mug.jpg", f"a/{mask}"]) == {f"a/{mask}": "a/mug.jpg"}


@pytest.mark.parametrize(
    "names",
    [
        ["gas_mask.png"],
        ["mask.png", "mug.png"],
        ["a/mug.jpg", "b/mug_mask.png"],
        ["mug.jpg", "mug.png", "mug_mask.png"],
        ["mug.jpg", "mug_mask.png", "mug_mask.jpg"],
        ["mug.jpg", "mugmask.png"],
        ["_mask.png", "mug.png"],
    ],
)
def test_other_names_tell_none(names: list[str]) -> None:
    assert match_masks(names) == {}


def test_a_mask_has_none_itself() -> None:
    names = ["mug.jpg", "mug_mask.jpg", "mug_mask_mask.jpg"]
    assert match_masks(names) == {"mug_mask.jpg": "mug.jpg"}


def _folder(place: Path, *names: str) -> Path:
    for name in names:
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        Image.new("L", (64, 64), 90).save(place / name)
    return place


def test_a_folder_of_photos_and_masks(tmp_path: Path) -> None:
    folder = _folder(tmp_path, "cup.png", "mug.png", "mug_mask.png", "sub/pan.png", "sub/pan_mask.png", "gas_mask.png")
    notes = Notes()
    items = {Path(item.file or "").name: item.masks for item in iterate_items([folder], {}, notes)}
    assert items == {
        "cup.png": (),
        "gas_mask.png": (),
        "mug.png": (str(folder / "mug_mask.png"),),
        "pan.png": (str(folder / "sub/pan_mask.png"),),
    }
    assert notes.remarks == [f"{folder}: 6 files: 4 inputs (4 images), 2 masks of the photos beside"]


def test_photos_of_one_thing_in_a_folder_have_their_masks(tmp_path: Path) -> None:
    folder = _folder(tmp_path, "0.png", "1.png", "1_mask.png")
    (item,) = iterate_items([folder], {}, Notes(), views=True)
    assert [Path(file).name for file in item.files] == ["0.png", "1.png"]
    assert item.masks == ("", str(folder / "1_mask.png"))


def test_beside_a_mesh_a_mask_is_a_texture_or_a_photo(tmp_path: Path) -> None:
    folder = _folder(tmp_path, "mug.png", "mug_mask.png")
    (folder / "mug.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert list_folder(folder).masks == {}
