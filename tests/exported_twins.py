"""Twins made by hand for exports: nothing about them is symmetric, so that no swapped axis or sign goes unseen."""

from __future__ import annotations

import hashlib
import io
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
import trimesh
from PIL import Image
from scipy.spatial.transform import Rotation

from manitwin.assets.writers.exporter import TwinContent
from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.textures import make_part, pbr_material
from manitwin.geometry.hulls.reduction import hull_to_obj
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import write_twin_record
from record_overlay import overlaid
from rehearsal_cube import CUBE
from twin_folders import grasp_table

TWIN_ID = "5eed5eed5eed5eed"
NAME = "claw_hammer_5eed5eed"
MASS_KG, CENTER_OF_MASS_M = 0.37, [0.021, -0.013, 0.034]
MOMENTS_KG_M2 = np.array([2.1e-4, 4.7e-4, 5.9e-4])
INERTIA_KG_M2 = (lambda r: r @ np.diag(MOMENTS_KG_M2) @ r.T)(Rotation.from_euler("xyz", [0.4, -0.7, 1.1]).as_matrix())
STATIC, DYNAMIC, RESTITUTION = 0.62, 0.47, 0.15
BASE_COLOR_LINEAR = (0.5, 0.25, 0.125)


def hulls() -> list[np.ndarray]:
    """Three convex pieces ``(V, 3)`` m, none alike, that stand on z = 0."""
    head = trimesh.creation.box([0.03, 0.11, 0.04]).vertices + np.array([0.02, 0.01, 0.02])
    handle = trimesh.creation.box([0.16, 0.02, 0.018]).vertices + np.array([-0.06, -0.01, 0.03])
    knob = trimesh.creation.icosphere(subdivisions=1, radius=0.012).vertices + np.array([0.03, 0.05, 0.05])
    return [np.asarray(each) for each in (head, handle, knob)]


def texture() -> Image.Image:
    """Four fields: red, green above blue, yellow."""
    return Image.fromarray(
        np.kron(
            np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 0]]], np.uint8), np.ones((8, 8, 1), np.uint8)
        )
    )


def visual_parts() -> list[trimesh.Trimesh]:
    """The hulls, the first one textured (every face the whole picture), the others coloured."""
    head, *others = (trimesh.convex.convex_hull(each) for each in hulls())
    corners = head.triangles.reshape(-1, 3)
    uv = np.tile([[0.05, 0.05], [0.95, 0.05], [0.05, 0.95]], (len(head.faces), 1))  # blue, yellow, red
    painted = pbr_material("paint", base_color_texture=texture())
    plain = pbr_material("wood", base_color=BASE_COLOR_LINEAR, roughness=0.6)
    return [
        make_part(corners, np.arange(len(corners)).reshape(-1, 3), material=painted, name="head", uv=uv),
        *(make_part(each.vertices, each.faces, material=plain, name=f"piece {i}") for i, each in enumerate(others)),
    ]


def write_twin(folder: Path, **changes: Any) -> Path:
    """Write a finished twin folder, its record changed section by section; returns it."""
    (folder / "collision").mkdir(parents=True)
    for i, hull in enumerate(hulls()):
        (folder / "collision" / f"hull_{i:02d}.obj").write_bytes(hull_to_obj(hull))
    (folder / "visual.glb").write_bytes(write_glb(visual_parts()))
    pyarrow.parquet.write_table(grasp_table(1, 8), folder / "grasps.parquet")
    (folder / "source.obj").write_bytes(b"a made source\n")
    write_twin_record(folder, overlaid(_record(), changes))
    return folder


def write_rejected(folder: Path) -> Path:
    """Write a twin that the gate rejected; returns its folder."""
    folder.mkdir(parents=True)
    (folder / "source.obj").write_bytes(b"two things\n")
    kept = {k: v for k, v in _record().items() if k not in CUBE}
    rejection = {"stage": "gate", "reason": "several_objects", "detail": "two objects"}
    write_twin_record(folder, {**kept, "twin_id": "0" * 16, "status": "rejected", "rejection": rejection})
    return folder


def content(folder: Path, **changes: Any) -> TwinContent:
    """Write a twin and read it as exporters get it."""
    return TwinContent.of(Twin(write_twin(folder, **changes)))


def png_pixels(data: bytes) -> np.ndarray:
    """Return a picture's pixels ``(H, W, 3)``."""
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))


def estimate(value: float) -> dict[str, Any]:
    return {"value": value, "low": value * 0.8, "high": value * 1.2, "source": "prior:hammer"}


def _record() -> dict[str, Any]:
    corners = np.concatenate(hulls())
    source = {
        "kind": "mesh", "file": "source.obj", "sha256": hashlib.sha256(b"a made source\n").hexdigest(),
        "license": "CC-BY-4.0", "attribution": "Ada Lovelace",
    }  # fmt: skip
    named = {
        "twin_id": TWIN_ID, "name": "hammer", "status": "accepted", "rejection": None, "source": source,
        "provenance": {"manitwin_version": "0", "config_sha256": "c0", "seed": 0, "stages": {}},
        "quality": {"checks": []},
    }  # fmt: skip
    changes = {
        "mesh": {"repairs": ["2 holes closed"], "hulls": {"count": 3}},
        "physical": {
            "extents_m": np.ptp(corners, axis=0).tolist(), "mass_kg": estimate(MASS_KG), "material": "steel",
            "friction_static": estimate(STATIC), "friction_dynamic": estimate(DYNAMIC),
            "restitution": estimate(RESTITUTION), "center_of_mass_m": CENTER_OF_MASS_M,
            "inertia_kg_m2": INERTIA_KG_M2.tolist(),
        },
        "language": {"category": "Claw hammer", "caption": "A small claw hammer."},
    }  # fmt: skip
    return overlaid({**named, **CUBE}, changes)
