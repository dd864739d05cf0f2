"""Joint ranges in recorded episodes, as a table of the report."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pyarrow as pa

from manitwin.episodes.hdf5_file import EpisodeFile
from manitwin.episodes.stored_episode import RecordedRobot, robot_from_dict
from manitwin.errors import EpisodesError

SCHEMA = pa.schema(
    [
        ("robot", pa.string()),
        ("position", pa.int32()),
        ("joint", pa.string()),
        *((name, pa.float64()) for name in ("lowest_rad", "highest_rad", "lower_rad", "upper_rad", "used")),
        *((name, pa.float64()) for name in ("fastest_rad_s", "limit_rad_s")),
    ]
)
"""``used`` is the recorded range over the range of the limits; ``limit_rad_s`` is the planner's speed limit."""


def joint_ranges(files: Iterable[Path]) -> pa.Table:
    """Return a row for each arm joint of each robot in files of episodes; one array is in memory at a time."""
    found: dict[str, tuple[RecordedRobot, np.ndarray]] = {}
    for path in files:
        with EpisodeFile(path) as file:
            for number in range(len(file)):
                robot = robot_from_dict(file.metadata(number)["robot"])
                joints, group = len(robot.arm_joints), f"traj_{number}/obs/agent"
                both = [file.content.array(f"{group}/{name}") for name in ("qpos", "qvel")]
                if any(each.ndim != 2 or each.shape[1] < joints or not len(each) for each in both):
                    raise EpisodesError(f"{path}: {group} has not a column for each joint; write the episodes again")
                positions, speeds = both[0][:, :joints], np.abs(both[1][:, :joints])
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
