"""A twin as a page of text: what it says of poses."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from scipy.spatial.transform import Rotation

from manitwin.cli.summary import print_summary
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import RECORD, write_twin_record
from twin_folders import write_accepted


def placement(axis: str, degrees: float, probability: float, settled: bool = True) -> dict[str, Any]:
    rotation = Rotation.from_euler(axis, degrees, degrees=True).as_matrix()
    return {
        "position_m": [0.0, 0.0, 0.0], "quaternion_wxyz": quaternion_wxyz(rotation).tolist(), "probability": probability,
        "upright": bool(rotation[2, 2] > np.cos(np.radians(10))), "settled": settled, "collision_radius_m": 0.05,
    }  # fmt: skip


def shown(root: Path, placements: list[dict[str, Any]]) -> list[str]:
    folder = root / twin_name(write_accepted(root, 1))
    record = json.loads((folder / RECORD).read_bytes())
    del record["revision"], record["files"]
    write_twin_record(folder, record | {"placements": placements})
    page = io.StringIO()
    print_summary(Twin(folder), Console(width=200, file=page))
    return [" ".join(line.split()) for line in page.getvalue().splitlines()]


def test_settled_poses_come_first_and_likely_ones_before_unlikely(tmp_path: Path) -> None:
    lines = shown(
        tmp_path,
        [
            placement("x", 180, 0.1),
            placement("x", 90, 0.2, settled=False),
            placement("z", 30, 0.25),
            placement("y", -90, 0.3, settled=False),
            placement("y", 90, 0.15),
        ],
    )
    assert [line for line in lines if "probability" in line] == [
        "rests upright, probability 0.25, radius 5.0 cm",
        "rests lying on its +x side, 90 degrees from upright, probability 0.15, radius 5.0 cm",
        "rests upside down, probability 0.10, radius 5.0 cm",
        "did not settle lying on its -x side, 90 degrees from upright, probability 0.30, radius 5.0 cm",
        "did not settle lying on its -y side, 90 degrees from upright, probability 0.20, radius 5.0 cm",
    ]


def test_a_centre_of_mass_has_no_negative_zero(tmp_path: Path) -> None:
    folder = tmp_path / twin_name(write_accepted(tmp_path, 1))
    record = json.loads((folder / RECORD).read_bytes())
    del record["revision"], record["files"]
    record["physical"]["center_of_mass_m"] = [0.0, -1e-5, 0.086]
    write_twin_record(folder, record)
    page = io.StringIO()
    print_summary(Twin(folder), Console(width=200, file=page))
    assert "(0, 0, 86) mm" in page.getvalue()
