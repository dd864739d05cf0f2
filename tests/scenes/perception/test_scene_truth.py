"""What pictures are said to show, against rays at each object by itself; and what is no truth is refused."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from manitwin.errors import UsageError
from manitwin.geometry.poses import transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.render.cameras import Camera
from manitwin.render.raycast import cast_camera, merge_parts
from manitwin.scenes.loaded_scene import object_pose
from manitwin.scenes.perception.scene_truth import PictureTruth, SceneTruth, read_scene_truth
from manitwin.scenes.scene_files import scene_files
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import Twin


def in_world(scenes: Path, truth: SceneTruth, name: str) -> tuple[trimesh.Trimesh, np.ndarray]:
    """The mesh of an object in the world, and the part of each of its faces."""
    thing = next(each for each in truth.record.objects if each.name == name)
    twin = Twin(scenes.parent / "set" / twin_name(thing.twin_id))
    mesh = merge_parts(twin.visual)
    return trimesh.Trimesh(
        transform_points(object_pose(thing), mesh.vertices), mesh.faces, process=False
    ), twin.face_parts()


def widened(camera: Camera) -> Camera:
    """The same camera with three times the picture each way, the old one in its middle."""
    tangent = 3 * np.tan(camera.fov_y_rad / 2)
    return Camera(camera.camera_to_object, 2 * float(np.arctan(tangent)), 3 * camera.width_px, 3 * camera.height_px)


def test_views_are_those_of_rays_at_each_object_alone(scenes: Path, truths: list[SceneTruth]) -> None:
    shares = []
    for truth in truths:
        for picture in truth.pictures:
            for name, view in picture.views.items():
                mesh, _ = in_world(scenes, truth, name)
                alone = cast_camera(RayCaster(mesh), widened(picture.camera))[2] >= 0
                side = picture.camera.width_px
                in_frame = alone[side : 2 * side, side : 2 * side]
                visible = picture.ids == truth.ids[name]
                assert view.visible_px == visible.sum()
                assert abs(view.amodal_px - alone.sum()) <= 2 + 0.01 * alone.sum()
                assert abs(view.amodal_in_frame_px - in_frame.sum()) <= 2 + 0.01 * in_frame.sum()
                assert view.cut_by_frame == (in_frame.sum() < alone.sum()), (name, picture.name)
                shares.append(view.visible_share)
    assert min(shares) < 0.7 and max(shares) == 1, "something hides something"
    assert any(view.cut_by_frame for truth in truths for picture in truth.pictures for view in picture.views.values())


def test_parts_are_those_of_the_faces_that_rays_hit(scenes: Path, truths: list[SceneTruth]) -> None:
    for truth in truths:
        assert {part.name for part in truth.parts.values()} == {"base", "lid"}
        numbers = {(part.object, part.part_id): number for number, part in truth.parts.items()}
        (name,) = {part.object for part in truth.parts.values()}
        mesh, face_parts = in_world(scenes, truth, name)
        for picture in truth.pictures:
            face = cast_camera(RayCaster(mesh), picture.camera)[2]
            seen = (picture.ids == truth.ids[name]) & (face >= 0)
            told = np.array([numbers[name, "p0"], numbers[name, "p1"]])[face_parts[face[seen]]]
            assert seen.any() and (picture.parts[seen] == told).all()
            assert not picture.parts[picture.ids != truth.ids[name]].any(), "what has no parts has none"


def test_both_parts_are_seen(truths: list[SceneTruth]) -> None:
    assert {n for truth in truths for picture in truth.pictures for n in np.unique(picture.parts)} >= {0, 1, 2}


def changed(scenes: Path, tmp_path: Path) -> Path:
    copied = tmp_path / "scenes"
    shutil.copytree(scenes, copied)
    return scene_files(copied)[0]


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (lambda facts: facts.pop("parts"), "did not store parts"),
        (lambda facts: facts["ids"].pop("object_00"), "another scene"),
        (lambda facts: facts["cameras"].update(beyond=facts["cameras"]["front"]), "another scene"),
        (lambda facts: facts["cameras"]["front"].update(width_px=10**9), "width_px"),
        (lambda facts: facts["cameras"]["front"]["K"][0].__setitem__(0, "x"), "K"),
        (lambda facts: facts.update(depth_unit_m=5.0), "depth_unit_m"),
    ],
)
def test_facts_that_cannot_be_are_refused(scenes: Path, tmp_path: Path, change: object, cause: str) -> None:
    file = changed(scenes, tmp_path)
    facts_file = file.parent / "pictures" / "pictures.json"
    facts = json.loads(facts_file.read_text())
    change(facts)  # type: ignore[operator]
    facts_file.write_text(json.dumps(facts))
    with pytest.raises(UsageError, match=cause) as error:
        read_scene_truth(file)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("content", [b"", b"no picture", b"\x89PNG\r\n\x1a\n" + bytes(40)])
def test_damaged_pictures_are_refused(scenes: Path, tmp_path: Path, content: bytes) -> None:
    file = changed(scenes, tmp_path)
    (file.parent / "pictures" / "front_ids.png").write_bytes(content)
    with pytest.raises(UsageError, match=r"front_ids\.png") as error:
        _ = _front(read_scene_truth(file)).ids
    assert "\n" not in str(error.value)


def test_pictures_of_another_size_or_in_colours_are_no_truth(scenes: Path, tmp_path: Path) -> None:
    file = changed(scenes, tmp_path)
    pictures = file.parent / "pictures"
    shutil.copy(pictures / "front_ids_colors.png", pictures / "front_ids.png")
    with pytest.raises(UsageError, match="not single-channel integers"):
        _ = _front(read_scene_truth(file)).ids


def test_scenes_that_were_not_drawn_are_refused(scenes: Path, tmp_path: Path) -> None:
    file = changed(scenes, tmp_path)
    shutil.rmtree(file.parent / "pictures")
    with pytest.raises(UsageError, match=r"has no pictures; .*--pictures"):
        read_scene_truth(file)


def _front(truth: SceneTruth) -> PictureTruth:
    return next(picture for picture in truth.pictures if picture.name == "front")
