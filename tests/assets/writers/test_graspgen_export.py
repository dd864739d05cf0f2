"""GraspGen's files read as its own loader reads them: every grasp is where it was tried, with its verdict."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from known_twins import TWINS, brick, tray
from manitwin.assets.writers import graspgen
from manitwin.assets.writers.exporter import TwinContent
from manitwin.assets.writers.grasp_rows import grasp_rows
from manitwin.errors import ExportError
from manitwin.geometry.distance import distance_to_surface
from manitwin.geometry.poses import transform_points
from manitwin.geometry.ray_caster import RayCaster

PANDA_OFFSET_XYZW = [0.0, 0.0, 0.0, 1.0]  # GraspGen config/grippers/franka_panda.yaml
FINGERS_M = np.array([[0.04, 0, 0.1034], [-0.04, 0, 0.1034]])  # GraspGen config/grippers/franka_panda.py: apart along X


def written(twin: TwinContent, folder: Path) -> Path:
    for name, data in graspgen.export(twin).files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return folder


def loaded(folder: Path, gripper: str = "franka_panda") -> tuple[trimesh.Trimesh, np.ndarray, np.ndarray]:
    """The mesh, the grasps that held and those that failed, as GraspGen's load_object_grasp_data gives them."""
    lists = [(folder / "splits" / gripper / f"{split}.txt").read_text().split() for split in ("train", "valid")]
    (object_id,) = [line for names in lists for line in names]
    file = json.loads((folder / "grasp_data" / gripper / "map_uuid_to_path.json").read_text())[object_id]
    content = json.loads((folder / "grasp_data" / gripper / file).read_text())
    assert content["object"]["file"] == object_id
    mesh = trimesh.load(folder / "objects" / object_id)
    mesh.apply_scale(content["object"]["scale"])
    poses, mask = np.array(content["grasps"]["transforms"]), np.array(content["grasps"]["object_in_gripper"])
    assert mask.dtype == bool
    return mesh, poses[mask], poses[~mask]  # the loader's offset is the identity


@pytest.mark.parametrize("make", TWINS)
def test_loader_finds_the_grasps_as_they_were_tried(make: Any, tmp_path: Path) -> None:
    twin = make()
    mesh, held, failed = loaded(written(twin, tmp_path))
    rows = grasp_rows(twin, "panda", controls=True)
    assert np.allclose(held, rows.gripper_to_object[rows.held], atol=1e-4)
    assert np.allclose(failed, rows.gripper_to_object[~rows.held], atol=1e-4)
    assert np.allclose(mesh.extents, twin.physical.extents_m)
    assert mesh.bounds[0][2] == 0.0


@pytest.mark.parametrize("make", TWINS)
def test_tips_of_the_hand_lie_at_the_object(make: Any, tmp_path: Path) -> None:
    twin = make()
    mesh, held, _ = loaded(written(twin, tmp_path))
    tips = held[:, :3, 3] + 0.1034 * held[:, :3, 2]
    assert distance_to_surface(tips, mesh).max() < 0.04


@pytest.mark.parametrize("make", TWINS)
def test_the_object_is_between_the_fingers_of_graspgens_hand(make: Any, tmp_path: Path) -> None:
    mesh, held, _ = loaded(written(make(), tmp_path))
    tips = np.stack([transform_points(pose, FINGERS_M) for pose in held])  # (N, 2, 3)
    inwards = (tips[:, 1] - tips[:, 0]) / 0.08
    for side, direction in ((0, inwards), (1, -inwards)):
        distance_m, face = RayCaster(mesh).first_hits(tips[:, side], direction)
        assert ((face >= 0) & (distance_m < 0.08)).all()


def test_gripper_block_says_how_the_poses_are_meant() -> None:
    files = graspgen.export(brick()).files
    block = json.loads(files["grasp_data/franka_panda/brick_015a5a5a.json"])["gripper"]
    assert (block["name"], block["width"], block["depth"]) == ("franka_panda", 0.08, 0.1034)
    translation, rotation_xyzw = block["transform_offset_from_asset_to_graspgen_convention"]
    assert translation == [0, 0, 0]
    assert np.allclose(rotation_xyzw, PANDA_OFFSET_XYZW, atol=1e-4)


def test_unknown_gripper_keeps_the_grasp_frame_and_says_so() -> None:
    twin = brick()
    twin.grasps["gripper"] = ["mine"] * len(twin.grasps["gripper"])
    exported = graspgen.export(twin)
    content = json.loads(exported.files["grasp_data/mine/brick_015a5a5a.json"])
    assert np.allclose(content["grasps"]["transforms"], grasp_rows(twin, "mine", controls=True).gripper_to_object)
    assert "width" not in content["gripper"]
    assert any("which link of mine" in line for line in exported.cannot_say)


def test_too_few_failures_are_said() -> None:
    assert any("1 grasps failed" in line for line in graspgen.export(brick()).cannot_say)


def test_a_fifth_of_all_twins_is_for_validation() -> None:
    twin, valid = brick(), 0
    for number in range(200):
        record = twin.record.model_copy(update={"twin_id": f"{(number * 0x9E3779B97F4A7C15) % 2**64:016x}"})
        object.__setattr__(twin, "record", record)
        files = graspgen.export(twin).files
        train, held_out = (files[f"splits/franka_panda/{split}.txt"] for split in ("train", "valid"))
        assert (train == b"") != (held_out == b"")
        valid += held_out != b""
    assert 20 < valid < 60


def test_twin_without_parallel_grasps_is_refused() -> None:
    twin = brick()
    twin.grasps["width_m"] = [0.0] * len(twin.grasps["width_m"])
    with pytest.raises(ExportError, match="parallel gripper"):
        graspgen.export(twin)


def test_same_twin_gives_the_same_bytes() -> None:
    assert graspgen.export(tray()) == graspgen.export(tray())
