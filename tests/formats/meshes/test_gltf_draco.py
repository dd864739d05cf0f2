"""glTF whose geometry Draco has compressed: what comes out is what went in, and broken data is one line."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
import pytest
import trimesh

from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh

DRACO = "KHR_draco_mesh_compression"
BALL = trimesh.creation.icosphere(subdivisions=3, radius=0.2)
UV = np.column_stack([np.linspace(0, 1, len(BALL.vertices)), np.linspace(1, 0, len(BALL.vertices))])
COLORS = np.tile(np.array([[255, 0, 0]], np.uint8), (len(BALL.vertices), 1))


def _compressed() -> bytes:
    encoded = DracoPy.encode(
        BALL.vertices.astype(np.float32), BALL.faces.astype(np.uint32), tex_coord=UV, colors=COLORS
    )
    return bytes(encoded)


def _document(data: bytes) -> dict[str, Any]:
    """Return a document of one ball, whose geometry is only there compressed."""
    ids = {each["attribute_type"]: each["unique_id"] for each in DracoPy.decode(_compressed()).attributes}
    count = len(BALL.vertices)
    return {
        "asset": {"version": "2.0"},
        "extensionsUsed": [DRACO],
        "extensionsRequired": [DRACO],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "accessors": [
            {"componentType": 5126, "count": count, "type": "VEC3"},
            {"componentType": 5126, "count": count, "type": "VEC2"},
            {"componentType": 5121, "count": count, "type": "VEC3", "normalized": True},
            {"componentType": 5125, "count": 3 * len(BALL.faces), "type": "SCALAR"},
        ],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2},
                        "indices": 3,
                        "extensions": {
                            DRACO: {
                                "bufferView": 0,
                                # Draco's own types of attributes: positions 0, colours 2, texture coordinates 3
                                "attributes": {"POSITION": ids[0], "COLOR_0": ids[2], "TEXCOORD_0": ids[3]},
                            }
                        },
                    }
                ]
            }
        ],
        "nodes": [{"mesh": 0, "translation": [0, 1, 0]}, {"mesh": 0}],
        "scenes": [{"nodes": [0, 1]}],
    }


def _glb(place: Path, tree: dict[str, Any], data: bytes) -> Path:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    place.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)
    return place


def test_what_was_compressed_is_there_in_each_instance(tmp_path: Path) -> None:
    data = _compressed()
    parts = read_mesh(_glb(tmp_path / "ball.glb", _document(data), data)).parts
    assert len(parts) == 2
    upper, lower = parts
    assert len(lower.faces) == len(BALL.faces)
    assert lower.bounds == pytest.approx(BALL.bounds, abs=1e-4)
    assert upper.bounds == pytest.approx(BALL.bounds + np.array([0, 1, 0]), abs=1e-4)
    shown = np.asarray(lower.visual.material.baseColorTexture).reshape(-1, 3)
    assert np.median(shown, axis=0).tolist() == [255, 0, 0]
    merged = trimesh.Trimesh(lower.vertices, lower.faces, process=True, merge_tex=True, merge_norm=True)
    assert merged.is_watertight and merged.volume == pytest.approx(BALL.volume, rel=1e-3)


def test_accessors_with_data_of_their_own_are_read_without_a_decoder(tmp_path: Path) -> None:
    positions, faces = BALL.vertices.astype("<f4").tobytes(), BALL.faces.astype("<u4").tobytes()
    tree = _document(b"")
    tree["buffers"] = [{"byteLength": len(positions) + len(faces)}]
    tree["bufferViews"] = [
        {"buffer": 0, "byteLength": len(positions)},
        {"buffer": 0, "byteOffset": len(positions), "byteLength": len(faces)},
    ]
    (primitive,) = tree["meshes"][0]["primitives"]
    primitive["attributes"] = {"POSITION": 0}
    tree["accessors"][0]["bufferView"], tree["accessors"][3]["bufferView"] = 0, 1
    del tree["extensionsRequired"]
    parts = read_mesh(_glb(tmp_path / "ball.glb", tree, positions + faces)).parts
    assert parts[1].bounds == pytest.approx(BALL.bounds, abs=1e-6)


@pytest.mark.parametrize("broken", ["cut", "noise", "id", "no attributes", "view", "count"])
def test_broken_data_is_unreadable_in_one_line(tmp_path: Path, broken: str) -> None:
    data = _compressed()
    tree = _document(data)
    extension = tree["meshes"][0]["primitives"][0]["extensions"][DRACO]
    if broken == "cut":
        data = data[: len(data) // 2] + bytes(len(data) - len(data) // 2)
    elif broken == "noise":
        data = np.random.default_rng(0).bytes(len(data))
    elif broken == "id":
        extension["attributes"]["POSITION"] = 77
    elif broken == "no attributes":
        extension["attributes"] = None
    elif broken == "view":
        extension["bufferView"] = 5
    else:
        tree["accessors"][0]["count"] = 2**40
    with pytest.raises(InputError) as caught:
        read_mesh(_glb(tmp_path / "ball.glb", tree, data))
    assert caught.value.reason in ("unreadable", "too_large") and "\n" not in caught.value.detail
    assert caught.value.detail.startswith("ball.glb: ")
