"""glTF meshes that are bound to a skeleton: taken in the pose of the file, and refused where that cannot be told."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh
from manitwin.formats.meshes.textures import normals_of
from skinned_document import bound_bar


def _saved(folder: Path, tree: dict[str, Any]) -> Path:
    (folder / "arm.gltf").write_text(json.dumps(tree))
    return folder / "arm.gltf"


def test_a_bound_mesh_has_the_pose_of_the_file(tmp_path: Path) -> None:
    tree, bar = bound_bar()
    read = read_mesh(_saved(tmp_path, tree))
    (part,) = read.parts
    upper = bar.vertices[:, 1] > 1.001
    expected = np.array(bar.vertices)
    expected[upper] = np.column_stack([1 - bar.vertices[upper, 1], 1 + bar.vertices[upper, 0], bar.vertices[upper, 2]])
    assert np.allclose(part.vertices, np.add(expected, [0, 0, 5]), atol=1e-6)
    normals = normals_of(part)
    assert normals is not None and np.allclose(normals[upper], [0, 1, 0], atol=1e-6)
    assert np.allclose(normals[~upper], [1, 0, 0], atol=1e-6)
    assert read.findings == ["it is bound to a skeleton; it was taken in the pose that the file holds"]


def test_shares_of_joints_are_blended(tmp_path: Path) -> None:
    _, bar = bound_bar()
    tree, _ = bound_bar(np.full(len(bar.vertices), 0.5))
    (part,) = read_mesh(_saved(tmp_path, tree)).parts
    turned = np.column_stack([1 - bar.vertices[:, 1], 1 + bar.vertices[:, 0], bar.vertices[:, 2]])
    expected = np.add((bar.vertices + turned) / 2, [0, 0, 5])
    assert np.allclose(part.vertices[part.faces], expected[bar.faces], atol=1e-6)


@pytest.mark.parametrize(
    ("how", "cause"),
    [
        (lambda tree: tree["nodes"][0].update(skin=4), "a node names skin 4, which is not there"),
        (lambda tree: tree["skins"][0].update(joints=[1, 9]), "a joint of its skeleton is not in the scene"),
        (lambda tree: tree["scenes"][0].update(nodes=[0]), "a joint of its skeleton is not in the scene"),
        (lambda tree: tree["skins"][0].update(joints=[1]), "a vertex is bound to a joint that is not in its skeleton"),
        (lambda tree: tree["accessors"][-1].update(count=1), "fewer bind matrices than joints"),
        (
            lambda tree: tree["meshes"][0]["primitives"][0]["attributes"].pop("WEIGHTS_0"),
            "its vertices to no joint",
        ),
        (lambda tree: tree["meshes"][0]["primitives"][0]["attributes"].update(JOINTS_0=0), "JOINTS_0 or WEIGHTS_0"),
        (lambda tree: tree.update(skins={"a": 1}), "a node names skin 0, which is not there"),
    ],
)  # fmt: skip
def test_a_broken_skeleton_is_told(tmp_path: Path, how: Any, cause: str) -> None:
    tree, _ = bound_bar()
    how(tree)
    with pytest.raises(InputError, match=cause) as caught:
        read_mesh(_saved(tmp_path, tree))
    assert caught.value.reason == "unreadable"


def test_vertices_without_a_joint_are_told(tmp_path: Path) -> None:
    tree, _ = bound_bar()
    attributes = tree["meshes"][0]["primitives"][0]["attributes"]
    view = tree["accessors"][attributes["WEIGHTS_0"]]["bufferView"]
    buffer = tree["buffers"][tree["bufferViews"][view]["buffer"]]
    buffer["uri"] = "data:application/octet-stream;base64," + base64.b64encode(bytes(buffer["byteLength"])).decode()
    with pytest.raises(InputError, match="bound to no joint"):
        read_mesh(_saved(tmp_path, tree))
