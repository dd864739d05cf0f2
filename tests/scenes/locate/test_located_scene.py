"""A located view as a layout: what was found rests where it was found, and what else is seen is in the way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from located_views import BESIDE_M, BLOCK_M, BrickView, brick_view
from manitwin.errors import UsageError
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.scenes.loaded_scene import object_pose
from manitwin.scenes.locate.layout_files import dataset_of_twin, layout_document, write_layout
from manitwin.scenes.locate.located_scene import LocatedScene, located_scene
from manitwin.scenes.locate.proposals import Plane, table_plane
from manitwin.scenes.locate.world_frame import WorldFrame, base_world_frame, table_world_frame
from manitwin.scenes.scene import SurfaceBox
from manitwin.scenes.scene_files import dataset_of, read_scene, scene_files


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> BrickView:
    return brick_view(tmp_path_factory.mktemp("brick"), block=True)


@pytest.fixture(scope="module")
def plane(seen: BrickView) -> Plane:
    return table_plane(seen.view, np.random.default_rng(0))


def world_of(seen: BrickView, plane: Plane) -> WorldFrame:
    return table_world_frame(plane, transform_points(seen.object_to_camera, seen.model.center[None])[0])


def scene_of(seen: BrickView, plane: Plane, object_to_camera: np.ndarray) -> LocatedScene:
    return located_scene(seen.view, [(seen.thing(object_to_camera), seen.twin)], world_of(seen, plane), None, 0)


def turned(axis: tuple[float, float, float], degrees: float, up_m: float = 0.0) -> np.ndarray:
    turn = trimesh.transformations.rotation_matrix(np.deg2rad(degrees), axis)
    turn[2, 3] += up_m
    return np.asarray(turn)


def test_the_world_has_the_table_below_and_the_camera_behind_the_things(seen: BrickView, plane: Plane) -> None:
    world = world_of(seen, plane)
    brick = world.camera_to_world @ seen.object_to_camera
    assert brick[2, 2] > np.cos(np.deg2rad(1)) and abs(brick[2, 3]) < 0.004
    assert transform_points(brick, seen.model.center[None])[0, :2] == pytest.approx([0.5, 0.0], abs=0.01)
    assert world.camera_to_world[0, 3] < 0, "the camera is on the side of the base"
    assert not world.calibrated


def test_what_leans_a_little_and_floats_rests_flat_on_the_table(seen: BrickView, plane: Plane) -> None:
    found = scene_of(seen, plane, seen.object_to_camera @ turned((1, 0.4, 0), 3, up_m=0.004))
    assert found.record is not None and found.as_boxes == ()
    (brick,) = found.record.objects
    pose = object_pose(brick)
    true = world_of(seen, plane).camera_to_world @ seen.object_to_camera
    assert pose[2, 2] > np.cos(np.deg2rad(0.5)) and abs(pose[2, 3]) < 0.001
    assert np.linalg.norm(pose[:2, 3] - true[:2, 3]) < 0.006
    assert brick.placement == 0 and brick.supported_by is None and brick.surface == "table"
    (motion,) = found.motions
    assert 0.002 < motion[0] < 0.008 and np.deg2rad(2) < motion[1] < np.deg2rad(4.5), "as far as it was off"


def test_what_does_not_stay_is_boxes_and_the_rest_is_a_layout(seen: BrickView, plane: Plane) -> None:
    in_the_air = seen.object_to_camera @ turned((1, 0, 0), 0, up_m=0.1)
    alone = scene_of(seen, plane, in_the_air)
    assert alone.record is None and layout_document(alone)["reason"] == "nothing stays where it was found"
    beside = seen.object_to_camera @ transform(None, np.array([0.0, -0.12, 0.1]))
    things = [(seen.thing(beside), seen.twin), (seen.thing(seen.object_to_camera), seen.twin)]
    both = located_scene(seen.view, things, world_of(seen, plane), None, 0)
    assert both.record is not None and [each.name for each in both.record.objects] == ["object_01"]
    ((gone, why),) = both.as_boxes
    assert gone.placed.name == "object_00" and why.startswith("moves by") and "let go where it was found" in why
    assert both.place_of(things[1][0]) == 0 and both.place_of(things[0][0]) is None
    told = layout_document(both)["objects"]
    assert [each["as_boxes"] for each in told] == [why, None] and told[0]["moved_m"] is None


def test_what_else_is_seen_is_in_the_way_and_nothing_of_the_twin(seen: BrickView, plane: Plane) -> None:
    found = scene_of(seen, plane, seen.object_to_camera)
    assert found.furniture is not None
    boxes = found.furniture.boxes[1:]
    to_object = inverse(found.world.camera_to_world @ seen.object_to_camera)
    assert 0 < len(boxes) <= 30 and found.left_out == 0
    inside = [transform_points(to_object, corners_of(box)) for box in boxes]
    low, high = np.min([each.min(0) for each in inside], 0), np.max([each.max(0) for each in inside], 0)
    assert (low[:2] > BESIDE_M[:2] - 0.03).all() and (high[:2] < BESIDE_M[:2] + np.array(BLOCK_M[:2]) + 0.03).all()
    assert high[2] == pytest.approx(BLOCK_M[2], abs=0.01) and low[2] < 0.005, "from the table to its top"
    covered = sum(4 * box.half_extents_m[0] * box.half_extents_m[1] for box in boxes)
    assert covered > 0.6 * BLOCK_M[0] * BLOCK_M[1]


def corners_of(box: SurfaceBox) -> np.ndarray:
    signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
    return np.array(box.center_m) + signs * np.array(box.half_extents_m)


def test_the_same_view_makes_the_same_file_which_knows_its_twins(seen: BrickView, plane: Plane, tmp_path: Path) -> None:
    dataset = dataset_of_twin(seen.twin.folder)
    assert dataset is not None
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write_layout(tmp_path / name, scene_of(seen, plane, seen.object_to_camera), dataset)
    (first,), (second,) = (scene_files(tmp_path / name) for name in ("one", "two"))
    assert first.read_bytes() == second.read_bytes()
    assert dataset_of(first) == dataset and read_scene(first).clutter == "located"
    assert dataset_of_twin(tmp_path) is None, "it holds no twin, whatever lies beside it"


def test_a_calibration_gives_the_base_and_one_of_another_table_is_refused(seen: BrickView, plane: Plane) -> None:
    about = transform_points(seen.object_to_camera, seen.model.center[None])[0]
    object_to_base = transform(None, np.array([0.4, -0.2, 0.03]))
    camera_to_base = object_to_base @ inverse(seen.object_to_camera)
    world = base_world_frame(camera_to_base, plane, about)
    assert world.calibrated and world.lean_rad < np.deg2rad(1) and world.table_m == pytest.approx(0.03, abs=0.004)
    brick = world.camera_to_world @ seen.object_to_camera
    assert brick[:3, 3] == pytest.approx([0.4, -0.2, 0.03], abs=0.004)
    with pytest.raises(UsageError, match=r"--base: the visible table leans by [56]\.\d degrees"):
        base_world_frame(turned((0, 1, 0), 5.5) @ camera_to_base, plane, about)
