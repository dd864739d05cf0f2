"""A glTF document of a bar that is bound to two joints, built by hand."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import trimesh

COMPONENTS = {np.dtype("<f4"): 5126, np.dtype("<u2"): 5123, np.dtype("u1"): 5121}
QUARTER_TURN_ABOUT_Z = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]


def bound_bar(shares: np.ndarray | None = None) -> tuple[dict[str, Any], trimesh.Trimesh]:
    """Return a document of a bar along Y whose upper half an elbow at (0, 1, 0) has turned by a quarter, and the bar as bound.

    ``shares`` (V,) of the elbow in the vertices, by default all or nothing; the mesh's own node is far off, which says nothing.
    """
    bar = trimesh.creation.box((0.2, 2.0, 0.2)).subdivide().apply_translation((0, 1, 0))
    upper = (bar.vertices[:, 1] > 1.001).astype(float) if shares is None else shares
    weights = np.column_stack([1 - upper, upper, np.zeros((len(upper), 2))]).astype("<f4")
    joints = np.tile(np.array([0, 1, 0, 0], "u1"), (len(upper), 1))
    bind = np.tile(np.eye(4), (2, 1, 1))
    bind[1, 1, 3] = -1.0  # the elbow lies one metre up
    tables: dict[str, list[Any]] = {"buffers": [], "bufferViews": [], "accessors": []}

    def accessor(values: np.ndarray, kind: str) -> int:
        uri = "data:application/octet-stream;base64," + base64.b64encode(values.tobytes()).decode()
        tables["buffers"].append({"uri": uri, "byteLength": values.nbytes})
        tables["bufferViews"].append({"buffer": len(tables["buffers"]) - 1, "byteLength": values.nbytes})
        tables["accessors"].append(
            {
                "bufferView": len(tables["bufferViews"]) - 1,
                "componentType": COMPONENTS[values.dtype],
                "count": len(values),
                "type": kind,
            }
        )
        return len(tables["accessors"]) - 1

    attributes = {
        "POSITION": accessor(np.asarray(bar.vertices, "<f4"), "VEC3"),
        "NORMAL": accessor(np.tile(np.array([1, 0, 0], "<f4"), (len(upper), 1)), "VEC3"),
        "JOINTS_0": accessor(joints, "VEC4"),
        "WEIGHTS_0": accessor(weights, "VEC4"),
    }
    primitive = {"attributes": attributes, "indices": accessor(np.asarray(bar.faces, "<u2").reshape(-1), "SCALAR")}
    inverse_bind = accessor(np.asarray(bind.transpose(0, 2, 1), "<f4").reshape(2, 16), "MAT4")
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [
            {"mesh": 0, "skin": 0, "translation": [50, 50, 50]},
            {"children": [2], "translation": [0, 0, 5]},
            {"translation": [0, 1, 0], "rotation": QUARTER_TURN_ABOUT_Z},
        ],
        "meshes": [{"primitives": [primitive]}],
        "skins": [{"joints": [1, 2], "inverseBindMatrices": inverse_bind}],
        **tables,
    }, bar
