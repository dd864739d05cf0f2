"""A file of cameras with the photos of one thing: --poses, rows of a group, the identity, what a twin says of it."""

from __future__ import annotations

import json
import shutil
import zipfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

from manitwin.engine.stage import Draft
from manitwin.errors import InputError, UsageError
from manitwin.formats.camera_poses.posed_camera import Lens, PosedCamera, turned_upright
from manitwin.pipeline.assembly import _write_source
from manitwin.pipeline.item import Item, twin_id
from manitwin.pipeline.manifest import Notes, iterate_items
from manitwin.pipeline.quality import photos_checks
from manitwin.pipeline.stated_poses import poses_of, stated_poses
from manitwin.twin.record import Source
from posed_things import PLACES, colmap_text, pose_at, write_posed

POSES = [pose_at(*place) for place in PLACES[:4]]


@pytest.fixture
def photos(tmp_path: Path) -> list[Path]:
    return write_posed(tmp_path, POSES)


def _item(photos: list[Path], **said: Any) -> Item:
    (item,) = iterate_items(
        photos, said.pop("defaults", {}), Notes(), views=True, poses=photos[0].parent / "transforms.json", **said
    )
    return item


def test_views_with_poses_are_one_item_whose_identity_has_the_cameras(photos: list[Path]) -> None:
    item, file = _item(photos), photos[0].parent / "transforms.json"
    assert item.poses == str(file) and len(item.files) == 4
    assert Item.from_json(json.loads(json.dumps(item.to_json()))) == item
    assert "poses" not in Item(str(photos[0])).to_json()
    identity = twin_id(item)
    document = json.loads(file.read_text())
    file.write_text(
        json.dumps({**document, "aabb_scale": 4, "frames": [*document["frames"], document["frames"][0]]}, indent=1)
    )
    document["frames"][0]["file_path"] = "elsewhere/9.png"
    with pytest.raises(InputError, match="matches several entries of"):
        twin_id(item)
    document["frames"][0]["file_path"] = "other/0.png"
    file.write_text(json.dumps(document, indent=2))
    assert twin_id(item) == identity  # how it is written is no matter
    document["frames"][0]["transform_matrix"][0][3] += 0.01
    file.write_text(json.dumps(document))
    assert twin_id(item) != identity
    assert twin_id(_item(photos, defaults={"units": "mm"})) not in (identity, twin_id(item))


def test_rows_of_a_group_may_have_poses(photos: list[Path]) -> None:
    folder = photos[0].parent
    rows = "".join(f"{photo.name},thing,{'transforms.json' if photo is photos[0] else ''}\n" for photo in photos)
    (folder / "things.csv").write_text("file,group,poses\n" + rows)
    (item,) = iterate_items([folder / "things.csv"], {}, Notes(), strict=True)
    assert item == _item(photos)
    for rows, told in (
        ("file,poses\n0.png,transforms.json\n", "give their rows a group"),
        ("file,group,poses,turn_deg\n0.png,a,transforms.json,0\n1.png,a,,9\n", "give only one of them"),
        ("file,group,poses\n0.png,a,transforms.json\n", "there is only one"),
        ("file,group,poses\n0.png,a,nothing.json\n1.png,a,\n", r"group 'a' .*nothing\.json: not found"),
        ("file,group,poses\n0.png,a,a.json\n1.png,a,b.json\n", "the same poses"),
    ):
        (folder / "things.csv").write_text(rows)
        with pytest.raises(UsageError, match=told):
            list(iterate_items([folder / "things.csv"], {}, Notes(), strict=True))


def test_photos_that_do_not_go_with_the_file_are_named(photos: list[Path]) -> None:
    folder = photos[0].parent
    shutil.copy(photos[0], folder / "unposed.png")
    with pytest.raises(UsageError, match=r"unposed\.png: no pose in transforms\.json, which has 4 \(images/0\.png"):
        _item([*photos, folder / "unposed.png"])
    Image.open(photos[1]).crop((10, 0, 310, 240)).save(photos[1])
    with pytest.raises(
        UsageError, match=r"1\.png: 300 x 240 pixels, but its pose .* 320 x 240; give the photo uncropped"
    ):
        _item(photos)
    turned = Image.open(photos[0])
    exif = turned.getexif()
    exif[0x0112] = 3
    turned.save(photos[0], exif=exif)
    with pytest.raises(UsageError, match=r"0\.png: its EXIF orientation rotates it"):
        _item([photos[0], photos[2]])


def test_photos_of_another_split_are_not_those_of_the_poses(photos: list[Path]) -> None:
    folder = photos[0].parent
    for split, numbers in (("images", range(4)), ("test", (1, 0, 3, 2))):
        (folder / split).mkdir()
        for number, own in enumerate(numbers):
            shutil.copy(photos[own], folder / split / f"{number}.png")
    poses = folder / "transforms.json"
    assert len(stated_poses([folder / "images" / f"{k}.png" for k in range(4)], poses).cameras) == 4
    assert len(stated_poses(photos, poses).cameras) == 4  # copies of what the file names
    with pytest.raises(InputError, match=r"test/0\.png: the pose of this name .* another picture, images/0\.png"):
        stated_poses([folder / "test" / f"{k}.png" for k in range(4)], poses)


@pytest.mark.parametrize("orientation", [6, 8])
def test_the_pose_of_a_picture_as_it_is_stored_is_that_of_the_upright_one(photos: list[Path], orientation: int) -> None:
    """The picture is turned and says so; the pose is still that of the picture as it was: a point is seen at the same place."""
    before = stated_poses(photos, photos[0].parent / "transforms.json").cameras[0]
    picture = Image.open(photos[0])
    exif = picture.getexif()
    exif[0x0112] = orientation
    picture.save(photos[0], exif=exif)
    after = stated_poses(photos, photos[0].parent / "transforms.json").cameras[0]

    def seen(camera: PosedCamera, point: list[float]) -> np.ndarray:
        at = camera.world_to_camera @ [*point, 1.0]
        return at[:2] / at[2] * camera.lens.focal + camera.lens.centre_px

    (width, height), point = picture.size, [0.01, -0.02, 0.03]
    x, y = seen(before, point)
    assert seen(after, point) == pytest.approx([height - y, x] if orientation == 6 else [y, width - x])
    assert after.lens.size_px == (height, width)


def test_the_distortion_of_a_stored_picture_turns_with_it() -> None:
    lens = Lens((300, 310), (150, 110), (320, 240), distortion=(0.1, 0.02, 0.01, -0.02))
    matrix = np.array([[300, 0, 150], [0, 310, 110], [0, 0, 1.0]])
    point = np.array([[0.2, -0.1, 1.0]])
    x, y = cv2.projectPoints(point, np.zeros(3), np.zeros(3), matrix, np.array(lens.distortion))[0].ravel()
    for orientation, wanted in ((6, [240 - y, x]), (8, [y, 320 - x])):
        turned = turned_upright(PosedCamera("a", np.eye(4)[:3], lens), orientation)
        (fx, fy), (cx, cy) = turned.lens.focal, turned.lens.centre_px or (0, 0)
        matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
        moved = point @ turned.world_to_camera[:, :3].T
        found = cv2.projectPoints(moved, np.zeros(3), np.zeros(3), matrix, np.array(turned.lens.distortion))[0].ravel()
        assert found == pytest.approx(wanted)


def test_a_folder_of_views_is_in_natural_order_and_leaves_out_what_has_no_pose(tmp_path: Path) -> None:
    folder = tmp_path / "photos"
    folder.mkdir()
    (photo, *_) = write_posed(tmp_path, POSES[:1])
    for number in (10, 9, 100, 2):
        shutil.copy(photo, folder / f"shot{number}.png")
    notes = Notes()
    (item,) = iterate_items([folder], {}, notes, views=True, turns_deg=lambda count: [90.0 * k for k in range(count)])
    assert [Path(file).stem for file in item.files] == ["shot2", "shot9", "shot10", "shot100"]
    assert item.turns_deg == (0, 90, 180, 270)
    frames = [
        {"file_path": f"shot{k}", "transform_matrix": pose.tolist()} for k, pose in zip((2, 10), POSES, strict=False)
    ]
    (tmp_path / "transforms.json").write_text(json.dumps({"camera_angle_x": 0.7, "frames": frames}))
    (item,) = iterate_items([folder], {}, notes, views=True, poses=tmp_path / "transforms.json")
    assert [Path(file).stem for file in item.files] == ["shot2", "shot10"]
    assert any("no pose of shot9.png, shot100.png: left out" in remark for remark in notes.remarks)
    with pytest.raises(UsageError, match="poses apply to several photos of one object; give --views too"):
        list(iterate_items([folder], {}, Notes(), poses=tmp_path / "transforms.json"))


def test_the_world_is_turned_upright_and_the_unit_is_told(photos: list[Path]) -> None:
    folder = photos[0].parent
    turn = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    cameras, images = colmap_text(POSES, turn)
    (folder / "cameras.txt").write_text(cameras)
    (folder / "images.txt").write_text(images)
    of_json, of_colmap = stated_poses(photos, folder / "transforms.json"), stated_poses(photos, folder, units="cm")
    assert of_colmap.unit_m == 0.01 and "as was stated" in of_colmap.unit_said
    assert of_json.unit_m is None and of_json.unit_said == "not stated"
    assert "z axis" in of_json.up.said and "-y axis" in of_colmap.up.said
    assert of_colmap.turns_deg == pytest.approx([0, 50, 110, 170]) and of_json.turns_deg == pytest.approx(
        [0, 50, 110, 170]
    )
    for stated in (of_json, of_colmap):
        heights = [-(c.world_to_camera[:, :3].T @ c.world_to_camera[:, 3])[2] for c in stated.cameras]
        assert heights == pytest.approx([pose[2, 3] for pose in POSES])
    with pytest.raises(InputError, match="upside down"):
        stated_poses(photos, folder, up="y")


def test_a_twin_keeps_the_cameras_with_its_photos(photos: list[Path], tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    kept.mkdir()
    item = _item(photos, defaults={"units": "cm"})
    source = Source.model_validate(_write_source(Draft("t", item, seed=0), "photos", kept, True))
    assert source.poses is not None and (source.poses.file, source.poses.unit_m) == ("transforms.json", 0.01)
    with zipfile.ZipFile(kept / "source.zip") as archive:
        archive.extractall(kept)
    again = stated_poses([kept / f"photo_{k:02d}.png" for k in range(4)], kept / "transforms.json")
    before = poses_of(item)
    assert before is not None and again.unit_m == 0.01
    for one, other in zip(again.cameras, before.cameras, strict=True):
        assert one.world_to_camera == pytest.approx(other.world_to_camera) and one.lens.focal == other.lens.focal


def test_the_check_says_whose_cameras_and_whose_size(photos: list[Path]) -> None:
    poses = {"file": "transforms.json", "up": "the world's z axis", "unit": "m, as was stated", "metric": True}
    draft = Draft("t", _item(photos), seed=0)
    draft.fields["generation"] = {"generator": "lift", "notes": {"photos": {"cut_out": 4, "used": 4}, "poses": poses}}
    (check,) = photos_checks(draft)
    assert check.passed and "the size by their unit, m, as was stated" in check.message
    draft.fields["generation"]["notes"]["poses"] = {**poses, "unit": "not stated", "metric": False}
    assert "their unit not stated: no size by them" in photos_checks(draft)[0].message
