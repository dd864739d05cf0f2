"""The report's tables: attempts and the ranges of joints, asked with DuckDB."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import duckdb
import numpy as np
import pyarrow as pa

from manitwin.dataset.statistics.query import Query, Result, text
from manitwin.episodes.hdf5_file import EpisodeFile
from manitwin.episodes.statistics.queries import PRELUDE
from manitwin.episodes.stored_episode import RecordedRobot, robot_from

SCHEMA = pa.schema(
    [
        ("robot", pa.string()),
        ("position", pa.int32()),
        ("joint", pa.string()),
        *((name, pa.float64()) for name in ("lowest_rad", "highest_rad", "lower_rad", "upper_rad", "used")),
        *((name, pa.float64()) for name in ("fastest_rad_s", "limit_rad_s")),
    ]
)
"""``used`` is the recorded range as a share of the limits' range; ``limit_rad_s`` is the speed the planner keeps to."""


def joint_ranges(files: Iterable[Path]) -> pa.Table:
    """Return a row for every arm joint of every robot in files of episodes; the files are read one array at a time."""
    found: dict[str, tuple[RecordedRobot, np.ndarray]] = {}
    for path in files:
        with EpisodeFile(path) as file:
            for number in range(len(file)):
                robot = robot_from(file.said(number)["robot"])
                joints = slice(0, len(robot.arm_joints))
                group = file.file[f"traj_{number}/obs/agent"]
                positions, speeds = group["qpos"][:, joints], np.abs(group["qvel"][:, joints])
                here = np.stack([-positions.min(0), positions.max(0), speeds.max(0)])
                kept = found.get(robot.name)
                found[robot.name] = (robot, here if kept is None else np.maximum(kept[1], here))
    rows = [
        {
            "robot": name,
            "position": place,
            "joint": joint,
            "lowest_rad": float(-ends[0, place]),
            "highest_rad": float(ends[1, place]),
            "lower_rad": robot.lower_rad[place],
            "upper_rad": robot.upper_rad[place],
            "used": float(ends[0, place] + ends[1, place]) / (robot.upper_rad[place] - robot.lower_rad[place]),
            "fastest_rad_s": float(ends[2, place]),
            "limit_rad_s": robot.velocity_limits_rad_s[place],
        }
        for name, (robot, ends) in sorted(found.items())
        for place, joint in enumerate(robot.arm_joints)
    ]
    return pa.Table.from_pylist(rows, schema=SCHEMA)


class EpisodeTables:
    """Answer the report's queries from a table of attempts and one of joints."""

    def __init__(self, attempts: pa.Table | Path, joints: pa.Table):
        """Take the attempts as a table or a Parquet file. One thread, so that sums of floats do not depend on the machine."""
        self.connection = duckdb.connect()
        self.connection.execute("SET threads = 1; SET preserve_insertion_order = false")
        if isinstance(attempts, Path):
            self.connection.execute(f"CREATE TEMP VIEW attempts AS SELECT * FROM read_parquet({text(str(attempts))})")
        else:
            self.connection.register("attempts", attempts)
        self.connection.register("joints", joints)
        self.connection.execute(PRELUDE)

    def result(self, query: Query) -> Result:
        """Run a query; floats come with 12 digits."""
        cursor = self.connection.execute(query.sql)
        names = [column[0] for column in cursor.description]
        return Result(query, [dict(zip(names, map(_rounded, row), strict=True)) for row in cursor.fetchall()])


def _rounded(value: object) -> object:
    return float(f"{value:.12g}") if isinstance(value, float) else value
