"""The grasp table ``grasps.parquet``: one row per grasp that was tried, successful or failed (docs/twin.md)."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.errors import TwinError
from manitwin.formats.parquet_file import open_parquet
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.twin.store import REMEDY

JITTERED = ":jittered"
PART = "part_id"
JOINTS = ("pregrasp_joints_rad", "grasp_joints_rad")
"""Arrays of ``proposals.npz`` for hands with several joints, each ``(N, J)``."""
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
        (PART, pa.string()),
        ("distance_to_point_m", pa.float64()),
        ("outcome", pa.string()),
        ("verified", pa.bool_()),
        ("displacement_m", pa.float64()),
        ("rotation_rad", pa.float64()),
        ("holds_in_second_engine", pa.bool_()),
        ("robustness", pa.float64()),
        ("robustness_trials", pa.int32()),
        ("retired", pa.bool_()),
        *((name, pa.list_(pa.float64())) for name in JOINTS),
    ]
)
_OF_VERSION_1 = [name for name in SCHEMA.names if name != PART]
FROM_PROPOSALS = ("width_m", "depth_m", "score", "proposer", "distance_to_point_m")
POINTED = ("grasp_point_id", "functional_point_id", PART)
"""What a grasp is associated with; '' in the arrays means none, and is null in the table."""


@dataclass(frozen=True)
class GripperRows:
    """All results for the proposals of one gripper, row by row.

    ``proposals`` holds the arrays of ``proposals.npz``; ``outcome``, ``displacement_m`` and ``rotation_rad`` are those of the
    trial. ``holds_in_second_engine`` and ``robustness`` are None for grasps without such trials.
    """

    gripper: str
    proposals: dict[str, np.ndarray]
    outcome: np.ndarray
    displacement_m: np.ndarray
    rotation_rad: np.ndarray
    holds_in_second_engine: list[bool | None]
    robustness: list[float | None]
    robustness_trials: list[int | None]
    ids: list[str]

    def columns(self, order: np.ndarray) -> dict[str, list[Any]]:
        """Return the table's columns, with the rows in the given order."""
        poses = self.proposals["gripper_to_object"][order]
        return {
            "grasp_id": [self.ids[i] for i in order],
            "gripper": [self.gripper] * len(order),
            "position_m": poses[:, :3, 3].tolist(),
            "quaternion_wxyz": quaternion_wxyz(poses[:, :3, :3]).tolist(),
            **{name: self.proposals[name][order].tolist() for name in FROM_PROPOSALS},
            **{name: [each or None for each in self.proposals[name][order].tolist()] for name in POINTED},
            "outcome": self.outcome[order].tolist(),
            "verified": (self.outcome[order] == "held").tolist(),
            "displacement_m": self.displacement_m[order].tolist(),
            "rotation_rad": self.rotation_rad[order].tolist(),
            "holds_in_second_engine": [self.holds_in_second_engine[i] for i in order],
            "robustness": [self.robustness[i] for i in order],
            "robustness_trials": [self.robustness_trials[i] for i in order],
            "retired": [False] * len(order),
            **{name: self._joints(name, order) for name in JOINTS},
        }

    def _joints(self, name: str, order: np.ndarray) -> list[Any]:
        """Return the joint values of hands with several joints; null for other grippers."""
        return self.proposals[name][order].tolist() if name in self.proposals else [None] * len(order)


def read_grasp_table(path: Path) -> pa.Table:
    """Return a twin's ``grasps.parquet`` with the columns of ``SCHEMA``. Raises TwinError.

    Tables of schema version 1 have no ``part_id``: it is then null in all rows.
    """
    if not os.path.lexists(path):
        raise TwinError(f"{path}: missing; {REMEDY}")
    with open_parquet(path, TwinError, schema=SCHEMA, optional=(PART,), remedy=REMEDY, inside=path.parent) as file:
        if PART in file.names:
            return file.read(SCHEMA.names)
        table = file.read(_OF_VERSION_1)
    place, field = SCHEMA.get_field_index(PART), SCHEMA.field(PART)
    return table.add_column(place, field, pa.nulls(len(table), field.type))


def write_grasp_table(path: Path, parts: list[dict[str, list[Any]]]) -> None:
    """Write the concatenated columns of all parts; equal arguments give equal bytes."""
    columns = {name: [value for part in parts for value in part[name]] for name in SCHEMA.names}
    pq.write_table(pa.table(columns, schema=SCHEMA), path, compression="zstd", version="2.6")
