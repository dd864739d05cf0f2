"""Parts, openings and directions are asked about where their words mean one place."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from drawn_scenes import SIZE_PX, add_parts, write_scenes
from manitwin.geometry.poses import transform
from manitwin.render.cameras import Camera, look_at
from manitwin.scenes.layouts.previews import write_previews
from manitwin.scenes.perception.scene_truth import PICTURES_FOLDER, read_scene_truth
from manitwin.scenes.scene_files import read_scene, scene_files
from manitwin.scenes.vqa.detection import is_order_unambiguous
from manitwin.scenes.vqa.directions import picture_directions
from manitwin.scenes.vqa.generate import drafts_of
from manitwin.scenes.vqa.part_words import is_locatable
from manitwin.scenes.vqa.posed_objects import PosedObject, TwinShape, posed_objects_of
from manitwin.scenes.vqa.question import Draft
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.store import RECORD, write_twin_record
from scene_twins import BOWL_HEIGHT_M, BOWL_RADIUS_M


def drafts(root: Path, family: str) -> list[Draft]:
    """Return what may be asked about the first scene below a folder, drawn now."""
    file = scene_files(root / "scenes")[0]
    write_previews(
        read_scene(file), lambda each: root / "set" / twin_name(each), file.parent / PICTURES_FOLDER, size_px=SIZE_PX
    )
    scene = read_scene_truth(file)
    found = drafts_of(scene, lambda each: TwinShape.of_twin(root / "set" / twin_name(each)), ["box", "can"], 0)
    return [each for each in found if each.family == family]


def twin_folder(root: Path, category: str) -> Path:
    """Return the folder of the twin of a category in the first scene."""
    record = read_scene(scene_files(root / "scenes")[0])
    return root / "set" / twin_name(next(each.twin_id for each in record.objects if each.category == category))


def add_opening(folder: Path) -> None:
    """Say of the bowl where it opens: the point at one place of its rim, the frame in the middle."""
    record = json.loads((folder / RECORD).read_bytes())
    point = record["points"]["functional"][0]
    point |= {"label": "opening", "position_m": [0.0, BOWL_RADIUS_M, BOWL_HEIGHT_M]}
    point["frame"] = {
        "position_m": [0.0, 0.0, BOWL_HEIGHT_M], "quaternion_wxyz": [1.0, 0.0, 0.0, 0.0], "kind": "opening",
        "size_m": BOWL_RADIUS_M, "free": "roll", "source": "geometry",
    }  # fmt: skip
    del record["revision"], record["files"]
    write_twin_record(folder, record)


def test_an_opening_is_in_its_middle_and_not_at_a_place_of_its_rim(tmp_path: Path) -> None:
    scenes = write_scenes(tmp_path)
    add_opening(twin_folder(tmp_path, "mixing bowl"))
    asked = [each for each in drafts(tmp_path, "interaction_point_occluded") if each.evidence["label"] == "opening"]
    assert {(each.camera, each.answer) for each in asked} == {("above", "no")}  # the other one sees it edge on
    scene = read_scene_truth(scene_files(scenes)[0])
    bowl = next(each for each in scene.record.objects if each.category == "mixing bowl")
    camera = next(each.camera for each in scene.pictures if each.name == "above")
    middle_m = np.array([*bowl.position_m[:2], BOWL_HEIGHT_M])
    in_camera = np.linalg.inv(camera.camera_to_object) @ [*middle_m, 1.0]
    column = camera.width_px / 2 - camera.focal_px * in_camera[0] / in_camera[2]
    row = camera.height_px / 2 + camera.focal_px * in_camera[1] / in_camera[2]
    np.testing.assert_allclose(asked[0].points[0], [column / camera.width_px, row / camera.height_px], atol=1e-3)


def test_an_opening_without_a_frame_is_not_asked_about(tmp_path: Path) -> None:
    write_scenes(tmp_path)
    folder = twin_folder(tmp_path, "mixing bowl")
    add_opening(folder)
    record = json.loads((folder / RECORD).read_bytes())
    record["points"]["functional"][0]["frame"] = None
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    asked = drafts(tmp_path, "interaction_point_occluded")
    assert "opening" not in {each.evidence["label"] for each in asked}


@pytest.mark.parametrize(("name", "is_asked"), [("base", True), ("body", False)])
def test_the_body_of_what_is_seen_is_never_out_of_sight(tmp_path: Path, name: str, is_asked: bool) -> None:
    write_scenes(tmp_path)
    add_parts(twin_folder(tmp_path, "box"), (name, "cover"))
    asked = [each for each in drafts(tmp_path, "part_visible") if each.evidence["part"] == name]
    assert ("no" in {each.answer for each in asked}) is is_asked


def test_a_box_that_lies_has_no_top_and_no_front(tmp_path: Path) -> None:
    scene = read_scene_truth(_drawn(tmp_path))
    box = posed_objects_of(scene, lambda each: TwinShape.of_twin(tmp_path / "set" / twin_name(each)))[0]
    lies = PosedObject(box.placed_as, box.number, box.shape, box.pose @ transform(np.array(_QUARTER_TURN)), None)
    assert [is_locatable(name, box) for name in ("top", "front", "handle")] == [True, False, True]
    assert [is_locatable(name, lies) for name in ("top", "front", "handle")] == [False, False, True]


def test_what_is_on_the_surface_is_counted_where_nothing_stands_on_another_thing(tmp_path: Path) -> None:
    write_scenes(tmp_path)
    assert drafts(tmp_path, "count_objects") and drafts(tmp_path, "list_objects")
    file = scene_files(tmp_path / "scenes")[0]
    scene = json.loads(file.read_bytes())
    scene["objects"][1]["supported_by"] = scene["objects"][0]["name"]
    file.write_text(json.dumps(scene))
    assert not drafts(tmp_path, "count_objects") and not drafts(tmp_path, "list_objects")
    assert drafts(tmp_path, "is_there")


def test_a_list_has_an_order_where_both_middles_of_things_tell_the_same() -> None:
    hammer, pan, mug = (183.0, 183.5), (222.0, 247.0), (241.0, 241.0)  # mean of the pixels, middle of the box
    assert is_order_unambiguous(np.array([hammer, pan]), 5) and is_order_unambiguous(np.array([hammer, mug]), 5)
    assert not is_order_unambiguous(np.array([hammer, pan, mug]), 5)
    assert not is_order_unambiguous(np.array([mug, (243.0, 243.0)]), 5)


def test_seen_from_above_nothing_goes_towards_the_camera() -> None:
    words = {}
    for name, eye in (("above", [0.5, -0.2, 1.2]), ("front", [0.5, -1.0, 0.3])):
        camera = Camera(look_at(np.array(eye), np.array([0.5, 0.0, 0.0])), 0.6, 64, 64)
        words[name] = {each.key: each for each in picture_directions(camera)}
        np.testing.assert_allclose(words[name]["towards"].vector, [0, -1], atol=1e-9)
    assert words["front"]["towards"].words == "straight towards the camera"
    assert words["above"]["towards"].words == "straight towards the lower edge of the picture"
    assert words["above"]["away"].words == "straight towards the upper edge of the picture"


_QUARTER_TURN = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]


def _drawn(root: Path) -> Path:
    write_scenes(root)
    drafts(root, "touch_point")
    return scene_files(root / "scenes")[0]
