"""Finished twin folders written by hand: small, of known numbers, without a pipeline."""

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
from manitwin.config import VerifyConfig
from manitwin.formats.glb import write_glb
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.pipeline.stage_order import STAGE_ORDER
from manitwin.pipeline.verify import describe, trial_settings
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.grasp_table import SCHEMA
from manitwin.twin.store import write_twin_record
from record_overlay import overlaid
from rehearsal_cube import CUBE

OUTCOMES = ("held", "held", "slips", "drops")


def twin_id(number: int) -> str:
    """A twin's id: the same number gives the same, and neighbours lie far apart, as hashes do."""
    return hashlib.sha256(str(number).encode()).hexdigest()[:16]


def box(x_m: float = 0.04, y_m: float = 0.06, z_m: float = 0.1) -> trimesh.Trimesh:
    mesh = trimesh.creation.box([x_m, y_m, z_m])
    mesh.apply_translation([0, 0, z_m / 2])
    return mesh


def tried_as_built() -> dict[str, Any]:
    """What a record says of the trial that a build would have put its grasps through."""
    settings = trial_settings(VerifyConfig(), load_gripper("panda"))
    return describe(SapienTrial(), settings, 0.5).model_dump(mode="json")


def write_accepted(
    root: Path,
    number: int,
    *,
    category: str = "mug",
    mass_kg: float = 0.3,
    grasps: int = 8,
    mesh: trimesh.Trimesh | None = None,
    source: bytes | None = None,
    seed: int = 0,
) -> str:
    """Write an accepted twin below a data set's root, over an older one; returns its id.

    Of the grasps every second pair holds; the last two are an unfiltered one that holds and a jittered one.
    """
    identity = twin_id(number)
    folder = root / twin_name(identity)
    folder.mkdir(parents=True, exist_ok=True)
    mesh = box() if mesh is None else mesh
    (folder / "visual.glb").write_bytes(write_glb([visual(mesh, baseColorFactor=[200, 20, 20, 255])]))
    pq.write_table(grasp_table(number, grasps), folder / "grasps.parquet")
    (folder / "source.obj").write_bytes(source or identity.encode())
    return _sealed(
        folder, {**_record(identity, folder, seed), **_sections(category, mass_kg, mesh, grasps)}, STAGE_ORDER[3:]
    )


def write_rejected(root: Path, number: int, *, seed: int = 0) -> str:
    """Write a twin that the gate has rejected, over an older one; returns its id."""
    identity = twin_id(number)
    folder = root / twin_name(identity)
    folder.mkdir(parents=True, exist_ok=True)
    for old in ("visual.glb", "grasps.parquet"):
        (folder / old).unlink(missing_ok=True)
    (folder / "source.obj").write_bytes(identity.encode())
    rejection = {"stage": "gate", "reason": "several_objects", "detail": "two objects"}
    record = {**_record(identity, folder, seed), "status": "rejected", "rejection": rejection}
    return _sealed(folder, record, STAGE_ORDER[3:6])


def _sealed(folder: Path, record: dict[str, Any], stages: tuple[str, ...]) -> str:
    costs = {name: {"seconds": 2.0, "cpu_seconds": 1.0, "cost_usd": 0.125} for name in stages}
    (folder / "run.json").write_text(json.dumps({"stages": costs, "host": {}}))
    ran = {name: {"version": "1", "backend": "builtin", "model": None} for name in sorted(stages)}
    record["provenance"]["stages"] = ran
    return write_twin_record(folder, record).twin_id


def _record(identity: str, folder: Path, seed: int) -> dict[str, Any]:
    digest = hashlib.sha256((folder / "source.obj").read_bytes()).hexdigest()
    source = {"kind": "mesh", "file": "source.obj", "sha256": digest, "license": "CC-BY-4.0", "attribution": "Ada"}
    return {
        "twin_id": identity,
        "name": "thing",
        "status": "accepted",
        "rejection": None,
        "source": source,
        "provenance": {"manitwin_version": "0", "config_sha256": "c0", "seed": seed},
        "quality": {"checks": [{"name": "known_name", "passed": False}, {"name": "watertight", "passed": True}]},
    }


def _sections(category: str, mass_kg: float, mesh: trimesh.Trimesh, grasps: int) -> dict[str, Any]:
    extents = mesh.extents.tolist()
    place = {"position_m": [0.01, 0.02, 0.03], "normal": [0.0, 0.0, 1.0], "confidence": 0.5, "rationale": "so"}
    return overlaid(
        CUBE,
        {
            "mesh": {"volume_m3": float(mesh.volume), "area_m2": float(mesh.area), "hulls": {"count": 2}},
            "physical": {
                "extents_m": extents, "obb": {"extents_m": extents}, "material": "ceramic",
                "mass_kg": {"value": mass_kg, "low": mass_kg / 2, "high": mass_kg * 2, "source": "prior:mug"},
            },
            "language": {"category": category, "material": "glazed ceramic", "caption": f"A red {category}."},
            "points": {
                "functional": [{"id": "f0", "candidate": 3, "label": "handle", "description": "a handle", **place}],
                "grasp": [
                    {"id": f"g{i}", "candidate": i, "type": "pinch", "scenario": "lift", **place} for i in range(2)
                ],
            },
            "grasps": {
                "gripper": "panda", "proposed": 50, "simulated": grasps - 2, "verified": 3, "success_rate": 0.5,
                "unfiltered_simulated": 1, "unfiltered_success_rate": 1.0, "failures": {"slips": 3},
                "approach_octants": 4,
                "second_opinion": {
                    "engine": "mujoco", "held_tried": 4, "holds_share": 0.75, "failed_tried": 0,
                    "failed_pass_share": None, "jittered": 1, "jittered_held": 0,
                    "jittered_hold_in_second_engine": 0, "jittered_agree": 1, "kappa": 0.25,
                },
            },
            "placements": [
                {**CUBE["placements"][0], "probability": share, "upright": share != 0.25} for share in (0.5, 0.25, 0.125)
            ],
        },
    )  # fmt: skip


def grasp_table(number: int, count: int) -> pa.Table:
    """Grasps whose place and turn are drawn from the number; see ``write_accepted`` for which hold."""
    rng = np.random.default_rng(number)
    turns = rng.normal(size=(count, 4))
    outcome = [OUTCOMES[i % 4] for i in range(count - 2)] + ["held", "slips"]
    proposer = ["antipodal"] * (count - 2) + ["antipodal:unfiltered", "antipodal:jittered"]
    columns: dict[str, list[Any]] = {name: [None] * count for name in SCHEMA.names}
    columns |= {
        "grasp_id": [f"panda-{i:04d}" for i in range(count)],
        "gripper": ["panda"] * count,
        "position_m": rng.normal(size=(count, 3)).tolist(),
        "quaternion_wxyz": (turns / np.linalg.norm(turns, axis=1, keepdims=True)).tolist(),
        **{name: rng.random(count).tolist() for name in ("width_m", "depth_m", "score", "robustness")},
        "proposer": proposer,
        "outcome": outcome,
        "verified": [each == "held" for each in outcome],
        "retired": [False] * count,
    }
    return pa.table(columns, schema=SCHEMA)


def write_set(root: Path, accepted: int = 6, rejected: int = 2) -> list[str]:
    """Write a data set of different twins, the accepted ones first; returns their ids."""
    kinds = ("mug", "bowl", "can")
    made = [
        write_accepted(root, n, category=kinds[n % 3], mass_kg=0.1 * (n + 1), grasps=8 + n, mesh=box(0.03 + 0.01 * n))
        for n in range(accepted)
    ]
    return made + [write_rejected(root, n) for n in range(accepted, accepted + rejected)]
