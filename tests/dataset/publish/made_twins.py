"""Accepted twins of a few kilobytes, made without a pipeline: a box, a few rows, and bytes in place of pictures."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import trimesh

from handmade import visual
from manitwin.dataset.index.parts import write_part
from manitwin.formats.glb import write_glb
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.grasp_table import SCHEMA
from manitwin.twin.store import write_twin_record
from record_overlay import overlaid
from rehearsal_cube import CUBE

CORNERS_M = [0.02, 0.03, 0.05]


def grasp_rows(count: int, held: int) -> pa.Table:
    """``count`` grasps of which the first ``held`` are verified."""
    columns: dict[str, list[Any]] = {name: [None] * count for name in SCHEMA.names}
    columns |= {
        "grasp_id": [f"g{i}" for i in range(count)],
        "gripper": ["panda"] * count,
        "position_m": [[0.0, 0.0, 0.1 + i / 1000] for i in range(count)],
        "quaternion_wxyz": [[0.0, 1.0, 0.0, 0.0]] * count,
        "proposer": ["antipodal"] * count,
        "outcome": ["held" if i < held else "slips" for i in range(count)],
        "verified": [i < held for i in range(count)],
        **{name: [0.04] * count for name in ("width_m", "depth_m", "score")},
        "retired": [False] * count,
    }
    return pa.table(columns, schema=SCHEMA)


def accepted_record(twin_id: str, category: str, source: dict[str, Any], count: int, held: int) -> dict[str, Any]:
    extents = [2 * corner for corner in CORNERS_M]
    place = {"position_m": [0.0, 0.0, 0.05], "normal": [0.0, 0.0, 1.0], "confidence": 0.5, "rationale": ""}
    return overlaid(
        CUBE,
        {
            "twin_id": twin_id, "name": category, "status": "accepted", "rejection": None, "source": source,
            "provenance": {"manitwin_version": "0", "config_sha256": "0", "seed": 0, "stages": {}},
            "mesh": {"volume_m3": float(np.prod(extents)), "hulls": {"count": 2}},
            "physical": {"extents_m": extents, "obb": {"extents_m": extents}},
            "language": {"category": category, "caption": f"A red {category}."},
            "points": {
                "functional": [{"id": "f0", "candidate": 0, "label": "top", "description": "the top", **place}],
                "grasp": [{"id": "p0", "candidate": 0, "type": "pinch", "scenario": "lift", **place}],
            },
            "grasps": {
                "gripper": "panda", "proposed": count, "simulated": count, "verified": held,
                "success_rate": held / count, "failures": {"slips": count - held}, "approach_octants": 1,
            },
            "quality": {"checks": []},
        },
    )  # fmt: skip


def make_twin(
    root: Path,
    twin_id: str,
    category: str = "mug",
    *,
    license: str = "CC-BY-4.0",
    attribution: str | None = "Ada",
    count: int = 4,
    held: int = 3,
    prompt: str | None = None,
    source_bytes: int = 100,
    failed_checks: tuple[str, ...] = (),
) -> Path:
    """Write a finished twin into a data set, of bytes that follow from its id; returns its folder."""
    folder = root / twin_name(twin_id)
    (folder / "views").mkdir(parents=True)
    (folder / "collision").mkdir()
    box = trimesh.creation.box([2 * corner for corner in CORNERS_M])
    box.apply_translation([0, 0, CORNERS_M[2]])
    (folder / "visual.glb").write_bytes(write_glb([visual(box, baseColorFactor=[200, 30, 30, 255])]))
    for number in range(2):
        (folder / "collision" / f"hull_{number:02d}.obj").write_bytes(box.export(file_type="obj").encode())
        (folder / "views" / f"rgb_{number:02d}.webp").write_bytes(f"rgb {number} {twin_id}".encode())
        (folder / "views" / f"marked_{number:02d}.webp").write_bytes(f"marked {number} {twin_id}".encode())
    (folder / "card.png").write_bytes(f"card {twin_id}".encode())
    pq.write_table(grasp_rows(count, held), folder / "grasps.parquet")
    content = twin_id.encode() * (source_bytes // len(twin_id) + 1)
    (folder / "source.zip").write_bytes(content)
    costs = {
        "stages": {"mesh": {"seconds": 2.0, "cpu_seconds": 1.0, "cost_usd": 0.5}},
        "host": {"machine": "secret-host"},
    }
    (folder / "run.json").write_text(json.dumps(costs))
    source = {
        "kind": "mesh", "file": "source.zip", "sha256": hashlib.sha256(content).hexdigest(), "prompt": prompt,
        "license": license, "attribution": attribution,
    }  # fmt: skip
    record = accepted_record(twin_id, category, source, count, held)
    checks = [{"name": name, "passed": False} for name in failed_checks]
    write_twin_record(folder, {**record, "quality": {"checks": checks}})
    return folder


def make_rejected(root: Path, twin_id: str) -> Path:
    """Write a rejected twin."""
    folder = root / twin_name(twin_id)
    folder.mkdir(parents=True)
    (folder / "source.png").write_bytes(b"")
    (folder / "run.json").write_text(json.dumps({"stages": {}, "host": {}}))
    source = {"kind": "image", "file": "source.png", "sha256": "0", "license": "unknown"}
    record = {
        "twin_id": twin_id, "name": None, "status": "rejected", "source": source, "quality": {"checks": []},
        "rejection": {"stage": "input", "reason": "empty", "detail": f"{root}/photo.png: empty"},
        "provenance": {"manitwin_version": "0", "config_sha256": "0", "seed": 0, "stages": {}},
    }  # fmt: skip
    write_twin_record(folder, record)
    return folder


def index(root: Path) -> None:
    """Write the data set's index."""
    dataset = DatasetRoot(root)
    write_part(dataset, list(dataset.twin_ids()))


def make_dataset(root: Path) -> Path:
    """A data set of seven accepted twins (four mugs, two salad bowls, a bowl of unknown licence) and a rejected one."""
    for number in range(4):
        make_twin(root, f"a{number}00000000000000", "mug", held=number)
    make_twin(root, "b000000000000000", "Salad bowl", license="CC0-1.0", attribution=None)
    make_twin(root, "b100000000000000", "salad bowl", attribution="Bob <bob@example.org> | et al.")
    make_twin(root, "c000000000000000", "bowl", license="unknown", attribution=None)
    make_rejected(root, "d000000000000000")
    index(root)
    return root
