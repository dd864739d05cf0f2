"""Outlines that a transforms.json names: cut out by them, in a build and in carve, part of the identity, kept with the photos."""

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
from manitwin.errors import InputError, UsageError
from manitwin.formats.outline_mask import read_mask
from manitwin.pipeline.assembly import _write_source
from manitwin.pipeline.carved_photos import carve_photos
from manitwin.pipeline.item import Item, twin_id
from manitwin.pipeline.manifest import Notes, iterate_items
from manitwin.pipeline.photo import PhotosStage
from manitwin.pipeline.stated_poses import stated_poses
from posed_things import HEIGHT, PLACES, WIDTH, pose_at, posed_photo, transforms_document

POSES = [pose_at(*place) for place in PLACES[:5]]


def _write(folder: Path, kind: str = "grey", **said: Any) -> list[Path]:
    """Write photos on a ground of all colours, which nothing tells from the thing but their masks, and the masks."""
    (folder / "masks").mkdir()
    document, paths = transforms_document(POSES, **said), []
    ground = np.random.default_rng(5).integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)
    for number, pose in enumerate(POSES):
        photo = posed_photo(pose)
        alpha = photo[..., 3]
        paths.append(folder / f"{number}.png")
        Image.fromarray(np.where(alpha[..., None] > 0, photo[..., :3], ground)).save(paths[-1])
        mask = {
            "grey": alpha,
            "ones": alpha // 255,
            "alpha": np.dstack([photo[..., :3], alpha]),
            "scene": 255 - alpha,
        }[kind]
        Image.fromarray(mask).save(folder / "masks" / f"{number}.png")
        document["frames"][number]["mask_path"] = f"masks/{number}.png"
    (folder / "transforms.json").write_text(json.dumps(document))
    return paths


def _item(photos: list[Path]) -> Item:
    (item,) = iterate_items(photos, {}, Notes(), views=True, poses=photos[0].parent / "transforms.json")
    return item


def test_carve_takes_the_masks(tmp_path: Path) -> None:
    made = carve_photos(_write(tmp_path, units="m"), None, poses=tmp_path / "transforms.json")
    assert made.metric and np.ptp(made.part.vertices[:, 2]) == pytest.approx(0.104, abs=0.004)
    assert "0.png: cut out as its mask says, 0.png" in made.findings


@pytest.mark.parametrize("kind", ["grey", "ones", "alpha"])
def test_photos_on_any_ground_are_cut_out_by_their_masks(tmp_path: Path, kind: str) -> None:
    photos = _write(tmp_path, kind)
    stage, folder = PhotosStage(MattingConfig()), tmp_path / "draft"
    folder.mkdir()
    field = stage.run(Draft("t", _item(photos), seed=0), folder)["matte"]
    assert field["method"] == "alpha" and len(field["photos"]) == 5
    for number, pose in enumerate(POSES):
        alpha = np.asarray(Image.open(folder / "photos" / f"{number:02d}.png"))[..., 3]
        assert np.array_equal(alpha > 127, posed_photo(pose)[..., 3] > 0)


def test_an_alpha_channel_of_the_photo_counts_too(tmp_path: Path) -> None:
    (photo, *_) = photos = _write(tmp_path)
    pixels = posed_photo(POSES[0])
    pixels[:, : WIDTH // 2, 3] = 0
    Image.fromarray(pixels).save(photo)
    folder = tmp_path / "draft"
    folder.mkdir()
    PhotosStage(MattingConfig()).run(Draft("t", _item(photos), seed=0), folder)
    alpha = np.asarray(Image.open(folder / "photos" / "00.png"))[..., 3]
    assert not alpha[:, : WIDTH // 2].any() and alpha.any()


def test_a_mask_that_is_none_is_refused_in_one_line(tmp_path: Path) -> None:
    photos = _write(tmp_path)
    mask = tmp_path / "masks" / "1.png"
    mask.unlink()
    with pytest.raises(UsageError, match=r"masks/1\.png: no mask is there"):
        _item(photos)
    Image.new("L", (WIDTH // 2, HEIGHT // 2)).save(mask)
    with pytest.raises(UsageError, match=r"masks/1\.png: a mask of 160 x 120 pixels, and its photo has 320 x 240"):
        _item(photos)
    mask.write_text("no picture")
    with pytest.raises(UsageError, match=r"1\.png"):
        _item(photos)


def test_a_mask_that_is_a_link_out_of_the_folder_is_not_opened(tmp_path: Path) -> None:
    folder = tmp_path / "shots"
    folder.mkdir()
    photos = _write(folder)
    mask = folder / "masks" / "1.png"
    mask.rename(tmp_path / "elsewhere.png")
    mask.symlink_to(tmp_path / "elsewhere.png")
    with pytest.raises(UsageError, match=r"masks/1\.png: a link that leads out of the folder"):
        _item(photos)


def _picture(value: Any) -> np.ndarray:
    return np.full((HEIGHT, WIDTH), value, np.uint8)


@pytest.mark.parametrize(
    ("pixels", "told"),
    [
        (_picture(0), "black everywhere"),
        (_picture(255), "keeps the border"),
        (255 - posed_photo(POSES[0])[..., 3], "keeps the border"),
        (np.dstack([_picture(200), _picture(20), _picture(20)]), "keeps the border"),
        (np.dstack([_picture(200), _picture(20), np.triu(_picture(200))]), "with several colours"),
    ],
)
def test_a_picture_that_is_no_outline_is_refused_in_one_line(tmp_path: Path, pixels: np.ndarray, told: str) -> None:
    Image.fromarray(pixels).save(tmp_path / "0.png")
    with pytest.raises(InputError, match=told) as caught:
        read_mask(tmp_path / "0.png", (HEIGHT, WIDTH))
    assert "0.png" in caught.value.detail and "\n" not in caught.value.detail


def test_the_mask_of_a_stored_picture_is_turned_as_its_exif_says(tmp_path: Path) -> None:
    (photo, *_) = photos = _write(tmp_path)
    upright = np.asarray(Image.open(tmp_path / "masks" / "0.png"))
    for orientation, turned in ((6, np.rot90(upright)), (8, np.rot90(upright, -1))):
        Image.fromarray(turned).save(tmp_path / "turned.png")
        assert np.array_equal(read_mask(tmp_path / "turned.png", upright.shape, orientation), upright)
        assert np.array_equal(read_mask(tmp_path / "masks" / "0.png", upright.shape, orientation), upright)
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.open(photo).save(photo, exif=exif)  # stored as the poses and the mask have it, shown on its side
    folder = tmp_path / "draft"
    folder.mkdir()
    PhotosStage(MattingConfig()).run(Draft("t", _item(photos), seed=0), folder)
    alpha = np.asarray(Image.open(folder / "photos" / "00.png"))[..., 3]
    assert np.array_equal(alpha > 127, np.rot90(upright, -1) > 127)


def test_masks_are_part_of_the_identity_and_kept_with_the_photos(tmp_path: Path) -> None:
    photos = _write(tmp_path)
    item = _item(photos)
    identity, before = twin_id(item), item.modified_at
    kept = tmp_path / "kept"
    kept.mkdir()
    _write_source(Draft("t", item, seed=0), "photos", kept, True)
    with zipfile.ZipFile(kept / "source.zip") as archive:
        archive.extractall(kept)
    again = stated_poses([kept / f"photo_{k:02d}.png" for k in range(5)], kept / "transforms.json")
    assert [camera.mask for camera in again.cameras] == [kept / f"mask_{k:02d}.png" for k in range(5)]
    assert (kept / "mask_03.png").read_bytes() == (tmp_path / "masks" / "3.png").read_bytes()
    Image.fromarray(np.roll(np.asarray(Image.open(tmp_path / "masks" / "3.png")), 1)).save(tmp_path / "masks" / "3.png")
    assert twin_id(item) != identity and before is not None and item.modified_at is not None
    assert item.modified_at >= before


@pytest.mark.slow
def test_lenses_with_pixels_that_are_not_square_and_lenses_of_one_frame_are_those_of_their_photos(
    tmp_path: Path,
) -> None:
    document = transforms_document(POSES, units="m")
    document |= {"w": WIDTH * 2, "cx": WIDTH, "fl_x": 2 * document["fl_x"]}
    photos = []
    for number, pose in enumerate(POSES):
        photo, wide = Image.fromarray(posed_photo(pose)), (WIDTH * 2, HEIGHT)
        if number == 2:  # scaled, as its frame says
            wide = (WIDTH // 2, HEIGHT // 2)
            scaled = {"fl_x": document["fl_x"] / 4, "fl_y": document["fl_y"] / 2, "cx": WIDTH / 4, "cy": HEIGHT / 4}
            document["frames"][number] |= scaled | {"w": wide[0], "h": wide[1]}
        photos.append(tmp_path / f"{number}.png")
        photo.resize(wide, Image.Resampling.NEAREST).save(photos[-1])
    (tmp_path / "transforms.json").write_text(json.dumps(document))
    made = carve_photos(photos, None, poses=tmp_path / "transforms.json")
    assert not made.carved.left_out
    assert np.ptp(made.part.vertices[:, 2]) == pytest.approx(0.104, abs=0.004)
