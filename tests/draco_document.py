"""A glTF document of a ball whose geometry Draco has compressed."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
import trimesh

DRACO = "KHR_draco_mesh_compression"
BALL = trimesh.creation.icosphere(subdivisions=3, radius=0.2)
UV = np.column_stack([np.linspace(0, 1, len(BALL.vertices)), np.linspace(1, 0, len(BALL.vertices))])
COLORS = np.tile(np.array([[255, 0, 0]], np.uint8), (len(BALL.vertices), 1))


def compressed_ball() -> bytes:
    """Return the ball with texture coordinates and red vertices as Draco compresses it."""
    encoded = DracoPy.encode(
        BALL.vertices.astype(np.float32), BALL.faces.astype(np.uint32), tex_coord=UV, colors=COLORS
    )
    return bytes(encoded)


def document_of_ball(data: bytes) -> dict[str, Any]:
    """Return a document of one ball, whose geometry is only there compressed."""
    ids = {each["attribute_type"]: each["unique_id"] for each in DracoPy.decode(compressed_ball()).attributes}
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


def write_glb_of(place: Path, tree: dict[str, Any], data: bytes) -> Path:
    """Write a GLB of a document and its binary chunk; returns its place."""
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    place.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)
    return place
