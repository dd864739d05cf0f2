"""A twin with joints, made by hand: a chain of three links of which nothing is symmetric, and that stands at no zero."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import exported_twins
from manitwin.formats.glb import read_glb
from manitwin.formats.npy_file import labels_to_npy
from manitwin.twin.link_records import FACE_LINKS
from manitwin.twin.store import RECORD, write_twin_record

NAMES = ("head", "handle", "knob")
MASSES_KG = (0.2, 0.12, 0.05)
CENTERS_M = ([0.021, 0.012, 0.019], [-0.055, -0.011, 0.031], [0.031, 0.049, 0.052])
TILTED = (np.array([0.2, 1.0, -0.3]) / np.linalg.norm([0.2, 1.0, -0.3])).tolist()
JOINTS: tuple[dict[str, Any], ...] = (
    {
        "name": "elbow", "type": "revolute", "parent": "head", "child": "handle", "origin_m": [0.01, -0.02, 0.03],
        "axis": TILTED, "lower": -0.4, "upper": 1.1, "locked_at": 0.35, "damping": 0.02, "friction": 0.03, "effort": 2.0,
        "velocity": 3.0,
    },
    {
        "name": "slide", "type": "prismatic", "parent": "handle", "child": "knob", "origin_m": [0.03, 0.05, 0.05],
        "axis": [0.0, 0.6, 0.8], "lower": -0.01, "upper": 0.06, "locked_at": 0.02, "damping": 0.5, "friction": 0.0,
        "effort": None, "velocity": None,
    },
)  # fmt: skip


def inertia(number: int) -> np.ndarray:
    """Return a tensor of which no axis is an axis of the object."""
    turn = Rotation.from_euler("xyz", [0.3 + number, -0.5, 0.9]).as_matrix()
    return np.asarray(turn @ np.diag(np.array([1.0, 1.7, 2.2]) * 1e-5 * (number + 1)) @ turn.T)


def links(faces: list[int]) -> list[dict[str, Any]]:
    """Return the table of links, of so many faces each."""
    return [
        {
            "name": name, "mass_kg": MASSES_KG[i], "center_of_mass_m": CENTERS_M[i], "inertia_kg_m2": inertia(i).tolist(),
            "source": "imported:urdf", "hulls": [i], "faces": faces[i],
        }
        for i, name in enumerate(NAMES)
    ]  # fmt: skip


def write_articulated(folder: Path, **changes: Any) -> Path:
    """Write the twin's folder, sections of its record changed; returns it."""
    exported_twins.write_twin(folder)
    faces = [len(part.faces) for part in read_glb(folder / "visual.glb")]
    labels = np.repeat(np.arange(len(faces), dtype=np.uint8), faces)
    (folder / FACE_LINKS).write_bytes(labels_to_npy(labels))
    record = json.loads((folder / RECORD).read_text())
    for sealed in ("files", "revision"):
        del record[sealed]
    write_twin_record(folder, {**record, "links": links(faces), "joints": list(JOINTS), **changes})
    return folder
