"""GLB: the visual file as the twin has it, hulls as meshes of their own, physics in extras."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

import exported_twins as made
from manitwin.assets.writers.glb import export
from manitwin.formats.glb import read_glb


def document(glb: bytes) -> dict[str, Any]:
    """The JSON chunk of a GLB, its header checked (glTF 2.0, section 4.4)."""
    magic, version, total = struct.unpack_from("<4sII", glb)
    assert (magic, version, total) == (b"glTF", 2, len(glb))
    length, kind = struct.unpack_from("<II", glb, 12)
    assert kind == 0x4E4F534A and length % 4 == 0
    return json.loads(glb[20 : 20 + length])


def test_the_visual_file_is_the_twins_own(tmp_path: Path) -> None:
    files = export(made.content(tmp_path / "twin")).files
    assert files["visual.glb"] == (tmp_path / "twin" / "visual.glb").read_bytes()


def test_hulls_are_closed_meshes_of_their_own_and_turn_back_to_the_object_frame(tmp_path: Path) -> None:
    place = tmp_path / "collision.glb"
    place.write_bytes(export(made.content(tmp_path / "twin")).files["collision.glb"])
    ours = read_glb(place)
    assert [part.metadata["name"] for part in ours] == [f"{made.NAME}_hull_{i:02d}" for i in range(3)]
    for part, hull in zip(ours, made.hulls(), strict=True):
        np.testing.assert_allclose(part.bounds, [hull.min(0), hull.max(0)], atol=1e-6)
    loaded = trimesh.load_scene(place)  # another reader: Y is up
    meshes = [loaded.geometry[f"{made.NAME}_hull_{i:02d}"] for i in range(3)]
    for mesh, hull in zip(meshes, made.hulls(), strict=True):
        assert mesh.is_watertight and mesh.is_convex
        y_up = np.stack([hull[:, 0], hull[:, 2], -hull[:, 1]], axis=1)
        np.testing.assert_allclose(mesh.bounds, [y_up.min(0), y_up.max(0)], atol=1e-6)
        assert np.isclose(mesh.volume, trimesh.convex.convex_hull(hull).volume, rtol=1e-3)


def test_physics_and_licence_are_in_the_document(tmp_path: Path) -> None:
    asset = document(export(made.content(tmp_path / "twin")).files["collision.glb"])["asset"]
    assert asset["copyright"] == "CC-BY-4.0, Ada Lovelace"
    physics = asset["extras"]["manitwin_physics"]
    assert physics["mass_kg"]["value"] == made.MASS_KG
    np.testing.assert_allclose(physics["inertia_kg_m2"], made.INERTIA_KG_M2, rtol=1e-12)
    assert "(x, z, -y)" in physics["frame"]
