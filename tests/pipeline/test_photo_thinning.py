"""Very many photos of one thing: thinned out evenly where turns or cameras are stated, told, refused where nobody says."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from manitwin.engine.stage import Draft
from manitwin.errors import Rejected, UsageError
from manitwin.pipeline.carved_photos import carve_photos
from manitwin.pipeline.item import Item, twin_id
from manitwin.pipeline.manifest import Notes, iterate_items
from manitwin.pipeline.photo_groups import group_photos
from manitwin.pipeline.photo_thinning import MOST_GIVEN, select_photos
from manitwin.pipeline.quality import photos_checks
from posed_things import pose_at, transforms_document


def _photos(folder: Path, count: int) -> list[Path]:
    paths = [folder / f"{number}.png" for number in range(count)]
    Image.new("RGB", (320, 240), (200, 200, 200)).save(paths[0])
    for path in paths[1:]:
        path.write_bytes(paths[0].read_bytes())
    return paths


def test_photos_with_turns_are_thinned_out_and_it_is_told(tmp_path: Path) -> None:
    photos, notes = _photos(tmp_path, 144), Notes()
    turns = [2.5 * number for number in range(144)]
    (item,) = iterate_items(photos, {}, notes, views=True, turns_deg=turns)
    assert item.files == tuple(map(str, photos[::2])) and item.turns_deg == pytest.approx(turns[::2])
    assert item.photos_given == 144 and Item.from_json(json.loads(json.dumps(item.to_json()))) == item
    assert notes.remarks == [
        "--views: 72 of 144 photos used, spread evenly over the directions: more say nothing new of the shape"
    ]
    draft = Draft("t", item, seed=0)
    draft.fields["generation"] = {"generator": "lift", "notes": {"photos": {"cut_out": 72, "used": 72}}}
    (check,) = photos_checks(draft)
    assert check.passed and check.message.startswith("72 of 144 photos used") and check.limit == 72
    (few,) = iterate_items(photos[::2], {}, Notes(), views=True, turns_deg=turns[::2])
    assert few.photos_given is None and "photos_given" not in few.to_json() and twin_id(few) != twin_id(item)


def test_rows_of_a_group_are_thinned_out(tmp_path: Path) -> None:
    rows = "".join(f"{photo.name},thing,{3 * k}\n" for k, photo in enumerate(_photos(tmp_path, 100)))
    (tmp_path / "things.csv").write_text("file,group,turn_deg\n" + rows)
    notes = Notes()
    (item,) = iterate_items([tmp_path / "things.csv"], {}, notes, strict=True)
    assert len(item.files) == len(item.turns_deg) == 72 and item.photos_given == 100
    assert len(notes.remarks) == 1 and "group 'thing'" in notes.remarks[0] and "72 of 100" in notes.remarks[0]


def test_photos_with_poses_are_thinned_out_by_where_their_cameras_look(tmp_path: Path) -> None:
    photos = _photos(tmp_path, 90)
    places = [(4.0 * number, 30.0, 0.3) for number in range(60)] + [(0.5 * number, 31.0, 0.3) for number in range(30)]
    (tmp_path / "transforms.json").write_text(json.dumps(transforms_document([pose_at(*place) for place in places])))
    (item,) = iterate_items(photos, {}, Notes(), views=True, poses=tmp_path / "transforms.json")
    kept = [int(Path(file).stem) for file in item.files]
    assert len(kept) == 72 and item.photos_given == 90 and kept == sorted(kept) and kept[0] == 0
    assert len([number for number in kept if number < 60]) >= 55  # the crowd on one side is what is thinned
    assert kept == select_photos(photos, [], tmp_path / "transforms.json")


def test_too_many_photos_are_refused_where_nobody_says_where_the_camera_was(tmp_path: Path) -> None:
    photos = _photos(tmp_path, 73)
    with pytest.raises(UsageError, match=r"73 photos of one object; give at most 72, .* or say where the camera was"):
        list(iterate_items(photos, {}, Notes(), views=True))
    items = [Item(f"/nowhere/{number}.png") for number in range(MOST_GIVEN + 1)]
    with pytest.raises(UsageError, match="give at most 4096"):
        group_photos(items, list(np.linspace(0, 359, len(items))), "--views")


def test_a_photo_without_a_pose_is_named_among_many(tmp_path: Path) -> None:
    photos = _photos(tmp_path, 74)
    poses = [pose_at(4.0 * number, 30, 0.3) for number in range(73)]
    (tmp_path / "transforms.json").write_text(json.dumps(transforms_document(poses)))
    with pytest.raises(UsageError, match=r"73\.png: no pose in transforms\.json"):
        list(iterate_items(photos, {}, Notes(), views=True, poses=tmp_path / "transforms.json"))


def test_carve_takes_as_many_as_a_build(tmp_path: Path) -> None:
    photos = [tmp_path / f"{number:02d}.png" for number in range(80)]
    for photo in photos:
        Image.new("RGBA", (40, 40)).save(photo)  # nothing in it: refused at once
    with pytest.raises(Rejected, match="none of 72 photos could be cut out"):
        carve_photos(photos, [4.5 * number for number in range(80)])
