"""Data sets of bricks whose grasps from above are known to hold, for robots."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.geometry.poses import quaternion_wxyz
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.grasp_table import SCHEMA
from manitwin.twin.store import RECORD, seal
from rigid_boxes import PANDA, above
from scene_twins import slab, write_thing

WIDTH_M, HEIGHT_M = 0.04, 0.1
TIPS_M = [[0.0, y, z] for y in (-0.01, 0.0, 0.01) for z in (0.07, 0.08)]


def write_brick(root: Path, number: int, category: str = "brick", grasps: int = 6) -> str:
    """Write 40 x 60 x 100 mm of 300 g with ``grasps`` verified grasps from above; returns its id."""
    identity = write_thing(root, number, slab(category, WIDTH_M, 0.06, HEIGHT_M, 0.3))
    folder = root / twin_name(identity)
    poses = [above(tip) for tip in TIPS_M[:grasps]]
    columns = {name: [None] * len(poses) for name in SCHEMA.names}
    columns |= {
        "grasp_id": [f"panda-{i:04d}" for i in range(len(poses))],
        "gripper": ["panda"] * len(poses),
        "position_m": [pose[:3, 3].tolist() for pose in poses],
        "quaternion_wxyz": [np.asarray(quaternion_wxyz(pose[:3, :3]), float).tolist() for pose in poses],
        "width_m": [WIDTH_M] * len(poses),
        "depth_m": [PANDA.tip_depth_m] * len(poses),
        "score": [1.0] * len(poses),
        "proposer": ["antipodal"] * len(poses),
        "outcome": ["held"] * len(poses),
        "verified": [True] * len(poses),
        "displacement_m": [0.0] * len(poses),
        "rotation_rad": [0.0] * len(poses),
        "retired": [False] * len(poses),
    }
    pq.write_table(pa.table(columns, schema=SCHEMA), folder / "grasps.parquet")
    record = json.loads((folder / RECORD).read_bytes())
    del record["revision"], record["files"]
    seal(folder, record)
    return identity
