"""``grasps.parquet``: one row a grasp that reached verification, held or failed (design of the twin folder)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.geometry.poses import quaternion_wxyz
from manitwin.simulate.trial import TrialResult

SCHEMA = pa.schema(
    [
        ("grasp_id", pa.string()),
        ("gripper", pa.string()),
        ("position_m", pa.list_(pa.float64(), 3)),
        ("quaternion_wxyz", pa.list_(pa.float64(), 4)),
        ("width_m", pa.float64()),
        ("depth_m", pa.float64()),
        ("score", pa.float64()),
        ("proposer", pa.string()),
        ("grasp_point_id", pa.string()),
        ("functional_point_id", pa.string()),
        ("distance_to_point_m", pa.float64()),
        ("outcome", pa.string()),
        ("verified", pa.bool_()),
        ("displacement_m", pa.float64()),
        ("rotation_rad", pa.float64()),
        ("holds_in_second_engine", pa.bool_()),
        ("robustness", pa.float64()),
        ("retired", pa.bool_()),
    ]
)

FROM_PROPOSALS = (
    "width_m",
    "depth_m",
    "score",
    "proposer",
    "grasp_point_id",
    "functional_point_id",
    "distance_to_point_m",
)


def write_grasp_table(path: Path, gripper: str, proposals: dict[str, np.ndarray], results: list[TrialResult]) -> None:
    """Write the grasps and their verdicts; equal arguments give equal bytes.

    ``proposals`` holds the arrays of ``proposals.npz``, in the order of ``results``. Second engine and robustness are
    null until something has measured them.
    """
    poses, count = proposals["gripper_to_object"], len(results)
    columns = {
        "grasp_id": [f"{gripper}-{number:04d}" for number in range(count)],
        "gripper": [gripper] * count,
        "position_m": poses[:, :3, 3].tolist(),
        "quaternion_wxyz": quaternion_wxyz(poses[:, :3, :3]).tolist(),
        **{name: proposals[name].tolist() for name in FROM_PROPOSALS},
        "outcome": [result.outcome for result in results],
        "verified": [result.outcome == "held" for result in results],
        "displacement_m": [result.displacement_m for result in results],
        "rotation_rad": [result.rotation_rad for result in results],
        "holds_in_second_engine": [None] * count,
        "robustness": [None] * count,
        "retired": [False] * count,
    }
    pq.write_table(pa.table(columns, schema=SCHEMA), path, compression="zstd", version="2.6")
