"""Data sets of bricks and bars whose grasps are known to hold, for robots."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.geometry.poses import quaternion_wxyz, transform
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.grasp_table import JOINTS, SCHEMA
from manitwin.twin.store import RECORD, write_twin_record
from rigid_boxes import FROM_ABOVE, PANDA, above
from scene_twins import Thing, slab, write_thing
from twin_folders import tried_as_built

WIDTH_M, HEIGHT_M = 0.04, 0.1
TIPS_M = [[0.0, y, z] for y in (-0.01, 0.0, 0.01) for z in (0.07, 0.08)]


BAR_M = (0.03, 0.24, 0.03)
LIP_M = 0.12  # of the suction cup's palm above its lip


def write_brick(root: Path, number: int, category: str = "brick", grasps: int = 6, gripper: str = "panda") -> str:
    """Write 40 x 60 x 100 mm of 300 g with up to ``grasps`` verified grasps of a gripper from above; returns its id."""
    joints: list[np.ndarray | None] = [None] * grasps
    if gripper == "panda":
        poses = [above(tip) for tip in TIPS_M[:grasps]]
    elif gripper == "suction":
        poses = [transform(FROM_ABOVE, np.array([0.0, y, HEIGHT_M + LIP_M])) for y in (0.0, 0.005, -0.005)]
    else:
        hand = load_gripper(gripper)
        assert isinstance(hand, MultiFingerGripper)
        poses = [transform(FROM_ABOVE, np.array([0.0, y, HEIGHT_M + 0.045])) for y in (0.0, 0.005, -0.005)]
        joints = [hand.postures[0].joints_at(np.array([WIDTH_M + 2 * hand.clearance_m, 0.02]))] * len(poses)
    return write_held(root, number, slab(category, WIDTH_M, 0.06, HEIGHT_M, 0.3), gripper, poses, WIDTH_M, joints)


def write_bar(root: Path, number: int, category: str = "bar") -> str:
    """Write 30 x 240 x 30 mm of 200 g with verified grasps of the Panda across it, by three of its sides; returns its id."""
    from_x = np.array([[0.0, 0, 1], [0, -1, 0], [1, 0, 0]])
    sides = (FROM_ABOVE, from_x, from_x @ np.diag([-1.0, 1, -1]))
    poses = [above([0, y, BAR_M[2] / 2], side) for side in sides for y in (-0.09, -0.06, 0.0, 0.06, 0.09)]
    return write_held(root, number, slab(category, *BAR_M, 0.2), "panda", poses, BAR_M[0], [None] * len(poses))


def write_held(
    root: Path,
    number: int,
    thing: Thing,
    gripper: str,
    poses: list[np.ndarray],
    width_m: float,
    joints: list[np.ndarray | None],
) -> str:
    """Write a thing with verified grasps of a gripper at ``poses (4, 4)``; returns its id."""
    identity = write_thing(root, number, thing)
    folder = root / twin_name(identity)
    columns = {name: [None] * len(poses) for name in SCHEMA.names}
    columns |= {
        "grasp_id": [f"{gripper}-{i:04d}" for i in range(len(poses))],
        "gripper": [gripper] * len(poses),
        "position_m": [pose[:3, 3].tolist() for pose in poses],
        "quaternion_wxyz": [np.asarray(quaternion_wxyz(pose[:3, :3]), float).tolist() for pose in poses],
        "width_m": [0.0 if gripper == "suction" else width_m] * len(poses),
        "depth_m": [PANDA.tip_depth_m] * len(poses),
        "score": [1.0] * len(poses),
        "proposer": ["antipodal"] * len(poses),
        "outcome": ["held"] * len(poses),
        "verified": [True] * len(poses),
        "displacement_m": [0.0] * len(poses),
        "rotation_rad": [0.0] * len(poses),
        "retired": [False] * len(poses),
    }
    for place, column in enumerate(JOINTS):
        columns[column] = [None if each is None else each[place].tolist() for each in joints[: len(poses)]]
    pq.write_table(pa.table(columns, schema=SCHEMA), folder / "grasps.parquet")
    record = json.loads((folder / RECORD).read_bytes())
    told = {"gripper": gripper, "gripper_sha256": load_gripper(gripper).sha256, "trial": tried_as_built()}
    record["grasps"] |= told
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    return identity
