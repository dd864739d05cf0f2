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
from manitwin.dataset_root import DatasetRoot, twin_name
from manitwin.files.glb import write_glb
from manitwin.index.parts import write_part
from manitwin.stages.grasp_table import SCHEMA
from manitwin.store import seal

CORNERS_M = [0.02, 0.03, 0.05]


def estimate(value: float) -> dict[str, Any]:
    return {"value": value, "low": value / 2, "high": value * 2, "source": "prior:thing"}


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


def grasp_summary(count: int, held: int) -> dict[str, Any]:
    trial = {
        "engine": "sapien", "finger_friction": 1.0, "object_friction": 0.4, "combine": "average", "force_n": 50.0,
        "timestep_s": 1 / 240, "solver_iterations": 20, "max_steps": 2000, "stable_frames": 3,
        "max_displacement_m": 0.01, "slide_distance_m": 0.1,
    }  # fmt: skip
    return {
        "gripper": "panda", "gripper_sha256": "0", "proposed": count, "proposed_by_filter": {}, "simulated": count,
        "verified": held, "success_rate": held / count, "unfiltered_simulated": 0, "unfiltered_success_rate": None,
        "failures": {"slips": count - held}, "approach_octants": 1, "file": "grasps.parquet",
        "association_radius_m": 0.03, "association_radius_widened": False, "share_beyond_3cm": 0.0, "trial": trial,
        "failure_table": {"by_grasp_type": {}, "by_region": {}}, "second_opinion": None, "robustness": None,
    }  # fmt: skip


def accepted_record(twin_id: str, category: str, source: dict[str, Any], count: int, held: int) -> dict[str, Any]:
    extents = [2 * corner for corner in CORNERS_M]
    identity = np.eye(4).tolist()
    place = {"position_m": [0.0, 0.0, 0.05], "normal": [0.0, 0.0, 1.0], "confidence": 0.5, "rationale": ""}
    return {
        "twin_id": twin_id, "name": category, "status": "accepted", "rejection": None, "source": source,
        "provenance": {"manitwin_version": "0", "config_sha256": "0", "seed": 0, "stages": {}},
        "mesh": {
            "vertices": 8, "faces": 12, "watertight": True, "components": 1, "euler_number": 2,
            "volume_m3": float(np.prod(extents)), "area_m2": 0.01, "repairs": [],
            "hulls": {"count": 2, "max_vertices": 8, "volume_ratio": 1.0, "surface_error_p95_m": 0.0,
                      "surface_uncovered_max_m": 0.0, "keeps_opening": None},
        },
        "physical": {
            "extents_m": extents, "obb": {"extents_m": extents, "obb_to_object": identity}, "scale_applied": 1.0,
            "material": "wood", "mass_kg": estimate(0.2), "friction_static": estimate(0.4),
            "friction_dynamic": estimate(0.3), "restitution": estimate(0.1), "density_kg_m3": 700.0,
            "center_of_mass_m": [0.0, 0.0, 0.05], "center_of_mass_uncertainty_m": 0.0,
            "inertia_kg_m2": [row[:3] for row in identity[:3]], "mass_distribution": "solid",
        },
        "language": {"category": category, "color": "red", "material": "wood", "size": "small", "shape": "box",
                     "function": "holding", "caption": f"A red {category}.", "captions": []},
        "points": {
            "candidates": {"positions_m": [[0.0, 0.0, 0.05]], "normals": [[0.0, 0.0, 1.0]]},
            "functional": [{"id": "f0", "candidate": 0, "label": "top", "description": "the top", **place}],
            "grasp": [{"id": "p0", "candidate": 0, "type": "pinch", "scenario": "lift", **place}],
        },
        "grasps": grasp_summary(count, held),
        "placements": [{"position_m": [0.0, 0.0, 0.0], "quaternion_wxyz": [1.0, 0.0, 0.0, 0.0], "probability": 1.0,
                        "upright": True, "settled": True, "collision_radius_m": 0.07}],
        "quality": {"checks": []},
    }  # fmt: skip


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
    seal(folder, accepted_record(twin_id, category, source, count, held))
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
    seal(folder, record)
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
