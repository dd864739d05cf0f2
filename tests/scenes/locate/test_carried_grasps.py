"""Grasps that are carried over to where a twin was found: free of the table and of what stands beside it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from grasped_twins import HEIGHT_M, write_brick
from manitwin.errors import UsageError
from manitwin.geometry.poses import inverse, transform_points
from manitwin.robots import grippers
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.scenes.locate.depth_view import DepthView
from manitwin.scenes.locate.estimate import Location, PoseEstimate, Status
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.proposals import table_plane
from manitwin.scenes.locate.recognition import ViewedObject
from manitwin.scenes.locate.transferred_grasps import transfer_grasps
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import RECORD, write_twin_record
from seen_solids import Seen, seen_from

NOISE_M = 0.001


@pytest.fixture(scope="module")
def brick(tmp_path_factory: pytest.TempPathFactory) -> Twin:
    root = tmp_path_factory.mktemp("bricks")
    return Twin(root / twin_name(write_brick(root, 0)))


@pytest.fixture(scope="module")
def model(brick: Twin) -> PoseModel:
    return PoseModel.of_twin(brick)


@pytest.fixture(scope="module")
def seen(model: PoseModel) -> Seen:
    return seen_from(model, 0.5, table=True)


def found_at(poses: list[np.ndarray], seen: Seen, model: PoseModel) -> ViewedObject:
    estimates = tuple(PoseEstimate(pose, 0.9, 1.0) for pose in poses)
    status: Status = "none" if not poses else "found" if len(poses) == 1 else "ambiguous"
    return ViewedObject(seen.mask, Location("brick", status, estimates, 0.9, "", 1000, 0.005), model, ())


def test_grasps_from_above_are_free_and_keep_clear_of_the_table(brick: Twin, seen: Seen, model: PoseModel) -> None:
    plane = table_plane(seen.view, np.random.default_rng(0))
    carried = transfer_grasps(found_at([seen.object_to_camera], seen, model), brick, seen.view, plane, NOISE_M)
    assert carried is not None and (carried.verified, carried.obstructed, carried.uncertain) == (6, 0, 0)
    for grasp in carried.grasps:
        at = inverse(seen.object_to_camera) @ grasp.gripper_to_camera
        assert at[2, 2] < -0.99, "from above, where symmetry also allows from below"
        assert transform_points(at, np.array([[0.0, 0, 0.1034]]))[0, 2] > 0.06, "the tips are at the top of the brick"


def test_upside_down_pose_of_a_symmetric_brick_has_the_same_grasps_from_above(
    brick: Twin, seen: Seen, model: PoseModel
) -> None:
    swapped = np.diag([1.0, -1, -1, 1])
    swapped[2, 3] = HEIGHT_M
    plane = table_plane(seen.view, np.random.default_rng(0))
    carried = transfer_grasps(
        found_at([seen.object_to_camera @ swapped], seen, model), brick, seen.view, plane, NOISE_M
    )
    assert carried is not None and len(carried.grasps) == 6
    above = [(inverse(seen.object_to_camera) @ grasp.gripper_to_camera)[2, 2] for grasp in carried.grasps]
    assert max(above) < -0.99


def test_what_stands_over_it_obstructs_the_hand(brick: Twin, seen: Seen, model: PoseModel) -> None:
    plane = table_plane(seen.view, np.random.default_rng(0))
    depth_m = seen.view.depth_m.copy()
    top = np.nonzero(seen.mask)[0].min()
    over = transform_points(seen.object_to_camera, np.array([[0.0, 0, HEIGHT_M + 0.05]]))[0]
    depth_m[max(0, top - 40) : top - 2, :] = over[2]
    view = DepthView(depth_m, seen.view.intrinsics)
    carried = transfer_grasps(found_at([seen.object_to_camera], seen, model), brick, view, plane, NOISE_M)
    assert carried is not None and not carried.grasps and carried.obstructed == 6


def test_of_ambiguous_poses_only_grasps_of_all_count(brick: Twin, seen: Seen, model: PoseModel) -> None:
    plane = table_plane(seen.view, np.random.default_rng(0))
    other = seen.object_to_camera.copy()
    other[:3, 3] += 0.05 * seen.object_to_camera[:3, 0]
    both = found_at([seen.object_to_camera, other], seen, model)
    carried = transfer_grasps(both, brick, seen.view, plane, NOISE_M)
    assert carried is not None and not carried.grasps and carried.uncertain == 6
    same = found_at([seen.object_to_camera] * 2, seen, model)
    certain = transfer_grasps(same, brick, seen.view, plane, NOISE_M)
    assert certain is not None and len(certain.grasps) == 6


def test_what_was_not_found_has_no_grasps(brick: Twin, seen: Seen, model: PoseModel) -> None:
    plane = table_plane(seen.view, np.random.default_rng(0))
    nowhere = found_at([], seen, model)
    assert transfer_grasps(nowhere, brick, seen.view, plane, NOISE_M) is None


def test_grasps_of_a_gripper_of_ones_own_are_carried_with_its_file(
    tmp_path: Path, seen: Seen, model: PoseModel
) -> None:
    panda = (Path(grippers.__file__).parent / "definitions" / "panda.toml").read_text()
    (tmp_path / "mine.toml").write_text(panda.replace('name = "panda"', 'name = "mine"'))
    mine = load_gripper(str(tmp_path / "mine.toml"))
    folder = tmp_path / "set" / twin_name(write_brick(tmp_path / "set", 0))
    table, record = pq.read_table(folder / "grasps.parquet"), json.loads((folder / RECORD).read_bytes())
    place = table.schema.get_field_index("gripper")
    table = table.set_column(place, table.schema.field(place), pa.array(["mine"] * len(table)))
    pq.write_table(table, folder / "grasps.parquet")
    record["grasps"] |= {"gripper": "mine", "gripper_sha256": mine.sha256}
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    plane, found = table_plane(seen.view, np.random.default_rng(0)), found_at([seen.object_to_camera], seen, model)
    with pytest.raises(UsageError, match=r"gripper mine is not shipped with the package.*--gripper"):
        transfer_grasps(found, Twin(folder), seen.view, plane, NOISE_M)
    carried = transfer_grasps(found, Twin(folder), seen.view, plane, NOISE_M, [mine])
    assert carried is not None and carried.verified == 6
