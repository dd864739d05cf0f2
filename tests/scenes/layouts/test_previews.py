"""Pictures of a layout as files, against rays and against what pictures.json says of them."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.errors import UsageError
from manitwin.geometry.poses import transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.render.cameras import Camera
from manitwin.render.raycast import cast_camera
from manitwin.scenes.layouts.previews import scene_pictures, write_previews
from manitwin.scenes.loaded_scene import object_pose
from manitwin.scenes.scene import (
    SCENE_SCHEMA_VERSION,
    Furniture,
    Light,
    SceneCamera,
    SceneMeasures,
    SceneObject,
    SceneRecord,
    SurfaceBox,
)
from manitwin.twin.dataset_root import twin_name
from twin_folders import box, twin_id, write_accepted

SIZE = 120
TABLE = SurfaceBox(name="board", center_m=(0.5, 0.0, -0.02), half_extents_m=(0.4, 0.5, 0.02), material="wood")


def scene(cameras: bool = True) -> SceneRecord:
    placed = [
        ("object_00", (0.45, -0.1, 0.0), (1.0, 0.0, 0.0, 0.0)),
        ("object_01", (0.6, 0.15, 0.03), (0.5**0.5, 0.5**0.5, 0.0, 0.0)),
    ]
    objects = tuple(
        SceneObject(
            name=name,
            twin_id=twin_id(1),
            revision="r",
            category="box",
            placement=0,
            position_m=position,
            quaternion_wxyz=quaternion,
        )
        for name, position, quaternion in placed
    )
    views = (
        SceneCamera(name="front", position_m=(1.5, 0.0, 0.7), target_m=(0.5, 0.0, 0.0), fov_y_rad=0.6),
        SceneCamera(name="above", position_m=(0.5, 0.0, 1.5), target_m=(0.5, 0.0, 0.0), fov_y_rad=0.6),
    )
    return SceneRecord(
        schema_version=SCENE_SCHEMA_VERSION,
        scene_id="layout_0_000001",
        seed=0,
        number=1,
        robot=None,
        clutter="sparse",
        furniture=Furniture(kind="table", support_height_m=0.0, boxes=(TABLE,)),
        objects=objects,
        ambient=(0.3, 0.3, 0.3),
        lights=(Light(direction=(0.3, 0.2, -1.0), color=(2.0, 2.0, 1.9), casts_shadow=True),),
        cameras=views if cameras else (),
        measures=SceneMeasures(max_moved_m=0.0, max_turned_rad=0.0, max_penetration_m=0.0, min_gap_m=None),
        repairs=0,
    )


@pytest.fixture(scope="module")
def twins(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("set")
    write_accepted(root, 1)
    return root


@pytest.fixture(scope="module")
def written(twins: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("out") / "pictures"
    files = write_previews(scene(), lambda each: twins / twin_name(each), folder, size_px=SIZE)
    assert sorted(folder.iterdir()) == files
    return folder


def world() -> tuple[trimesh.Trimesh, np.ndarray]:
    meshes = [
        trimesh.Trimesh(transform_points(object_pose(each), box().vertices), box().faces) for each in scene().objects
    ]
    board = trimesh.creation.box(2 * np.array(TABLE.half_extents_m)).apply_translation(TABLE.center_m)
    floor = trimesh.creation.box([24, 24, 0.1]).apply_translation([0, 0, -0.75 - 0.05])
    meshes += [board, floor]
    numbers = (1, 2, 3, 0)
    return trimesh.util.concatenate(meshes), np.concatenate(
        [np.full(len(mesh.faces), number) for mesh, number in zip(meshes, numbers, strict=True)]
    )


def test_files_agree_with_rays_through_the_cameras_that_are_written(written: Path) -> None:
    facts = json.loads((written / "pictures.json").read_text())
    assert facts["ids"] == {"object_00": 1, "object_01": 2, "board": 3}
    mesh, owner = world()
    for name, camera in facts["cameras"].items():
        fov = 2 * np.arctan(camera["height_px"] / 2 / camera["focal_px"])
        view = Camera(np.array(camera["camera_to_world"]), fov, camera["width_px"], camera["height_px"])
        depth, normals, face = cast_camera(RayCaster(mesh), view)
        ids, millimetres, colors = (
            cv2.imread(str(written / f"{name}_{what}.png"), cv2.IMREAD_UNCHANGED)
            for what in ("ids", "depth", "normals")
        )
        assert (ids.dtype, millimetres.dtype, colors.dtype) == (np.uint8, np.uint16, np.uint8)
        expected = np.where(face >= 0, owner[face], 0)
        assert (ids == expected).mean() > 0.999
        same = (ids == expected) & (face >= 0) & (depth < 10)
        assert np.quantile(np.abs(millimetres * facts["depth_unit_m"] - depth)[same], 0.999) <= 0.00055
        read = colors[..., ::-1].astype(float) / 127.5 - 1
        assert np.abs(read - normals)[same & (ids == 3)].max() < 0.01  # the twins' boxes are shaded as if round


def test_colours_beside_the_exact_pictures_are_of_the_same_depth_and_ids(written: Path) -> None:
    facts = json.loads((written / "pictures.json").read_text())
    for name in facts["cameras"]:
        ids, millimetres = (
            cv2.imread(str(written / f"{name}_{what}.png"), cv2.IMREAD_UNCHANGED) for what in ("ids", "depth")
        )
        shown = np.asarray(Image.open(written / f"{name}_ids_colors.png"))
        assert shown.shape[0] == SIZE and shown.shape[1] > SIZE  # the names are beside it
        for thing, number in facts["ids"].items():
            assert (shown[:, :SIZE][ids == number] == facts["colors_rgb"][thing]).all(), thing
            assert (shown[:, SIZE:] == facts["colors_rgb"][thing]).all(-1).sum() > 10, thing  # and its colour
        deep = np.asarray(Image.open(written / f"{name}_depth_colors.png"))[:, :SIZE].astype(int)
        nearest, farthest = (pick(millimetres[ids > 0]) for pick in (np.min, np.max))
        near, far = (deep[(ids > 0) & (millimetres == value)].mean(0) for value in (nearest, farthest))
        assert near[0] > 2 * near[2] and far[2] > far[1]  # red, and blue


def test_picture_shows_red_boxes_on_wood(written: Path) -> None:
    rgb = np.asarray(Image.open(written / "above_rgb.webp"))
    ids = cv2.imread(str(written / "above_ids.png"), cv2.IMREAD_UNCHANGED)
    assert rgb.shape == (SIZE, SIZE, 3)
    red = rgb[ids == 1].mean(0)
    assert red[0] > 2 * red[1]
    board = rgb[ids == 3].astype(float)
    assert board.std(0).min() > 5  # grain, joints and shadows
    assert 40 < board.mean() < 235


def test_same_scene_gives_the_same_files(written: Path, twins: Path, tmp_path: Path) -> None:
    write_previews(scene(), lambda each: twins / twin_name(each), tmp_path, size_px=SIZE)
    for path in sorted(written.iterdir()):
        assert path.read_bytes() == (tmp_path / path.name).read_bytes(), path.name


def test_scene_without_cameras_is_refused() -> None:
    with pytest.raises(UsageError, match="no cameras in its record"):
        scene_pictures(scene(cameras=False), lambda each: Path(each), width_px=16, height_px=16)
