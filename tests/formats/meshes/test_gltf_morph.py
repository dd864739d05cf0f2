"""Morph targets with the weights that the file holds, and vertex colours over textures: documents made by hand."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from test_gltf import POSITIONS, Maker, _save, _triangle

from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh
from manitwin.formats.meshes.textures import material_of, uv_of

UP = np.array([[0, 0, 1], [0, 0, 2], [0, 0, 0], [0, 0, 0]], dtype="<f4")
ALONG = np.array([[1, 0, 0]] * 4, dtype="<f4")


def _morphing(maker: Maker, *targets: np.ndarray) -> dict[str, Any]:
    return {**_triangle(maker), "targets": [{"POSITION": maker.array(each, "VEC3")} for each in targets]}


@pytest.mark.parametrize(
    ("of_mesh", "of_node", "shares", "said"),
    [
        (None, None, (0, 0), "its base shape was taken"),
        ([0, 0], None, (0, 0), "its base shape was taken"),
        ([0.5, 2], None, (0.5, 2), "they were taken as the file weighs them"),
        ([0.5], None, (0.5, 0), "they were taken as the file weighs them"),
        ([0.5, 2], [0, 1], (0, 1), "they were taken as the file weighs them"),
    ],
)
def test_targets_move_the_shape_by_the_weights_of_its_node_or_mesh(
    tmp_path: Path, of_mesh: list[float] | None, of_node: list[float] | None, shares: tuple[float, float], said: str
) -> None:
    maker = Maker()
    tree = maker.scene(_morphing(maker, UP, ALONG), **({} if of_node is None else {"weights": of_node}))
    if of_mesh is not None:
        tree["meshes"][0]["weights"] = of_mesh
    mesh = read_mesh(_save(tmp_path, tree))
    expected = (POSITIONS + shares[0] * UP + shares[1] * ALONG)[:3]
    np.testing.assert_allclose(mesh.parts[0].vertices[mesh.parts[0].faces.reshape(-1)], expected, atol=1e-6)
    assert f"it has morph targets; {said}" in mesh.findings


@pytest.mark.parametrize(("target", "weights"), [(UP[:3], [1]), (UP, ["much"])])
def test_targets_that_do_not_fit_are_refused(tmp_path: Path, target: np.ndarray, weights: list[Any]) -> None:
    maker = Maker()
    tree = maker.scene(_morphing(maker, target), weights=weights)
    with pytest.raises(InputError, match=r"a morph target does not fit its mesh|not a list of numbers"):
        read_mesh(_save(tmp_path, tree))


def _textured(maker: Maker, colors: np.ndarray) -> dict[str, Any]:
    buffer = io.BytesIO()
    Image.new("RGB", (2, 2), (200, 100, 50)).save(buffer, "PNG")
    maker.tree |= {
        "images": [{"uri": "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()}],
        "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 0.5, 1, 1]}}],
    }
    primitive = _triangle(maker)
    primitive["attributes"] |= {
        "COLOR_0": maker.array(colors, "VEC3"),
        "TEXCOORD_0": maker.array(POSITIONS[:, :2].copy(), "VEC2"),
        "TEXCOORD_1": maker.array(POSITIONS[:, :2] + np.float32(5), "VEC2"),
    }
    return {**primitive, "material": 0}


def test_one_colour_of_all_vertices_tints_their_texture(tmp_path: Path) -> None:
    maker = Maker()
    tree = maker.scene(_textured(maker, np.full((4, 3), (1, 0.5, 0.25), dtype="<f4")))
    mesh = read_mesh(_save(tmp_path, tree))
    material = material_of(mesh.parts[0])
    assert material.baseColorTexture is not None and mesh.findings == []
    np.testing.assert_allclose(material.baseColorFactor, [255, 64, 64, 255], atol=1)


def test_many_colours_over_a_texture_are_left_out_and_said(tmp_path: Path) -> None:
    maker = Maker()
    tree = maker.scene(_textured(maker, np.eye(4, 3, dtype="<f4")))
    mesh = read_mesh(_save(tmp_path, tree))
    assert mesh.findings == ["colours of its vertices, which tint a texture, were left out"]
    np.testing.assert_allclose(material_of(mesh.parts[0]).baseColorFactor, [255, 128, 255, 255], atol=1)


def test_a_texture_transform_may_name_other_coordinates(tmp_path: Path) -> None:
    maker = Maker()
    tree = maker.scene(_textured(maker, np.ones((4, 3), dtype="<f4")))
    texture = tree["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    texture["extensions"] = {"KHR_texture_transform": {"texCoord": 1}}
    (part,) = read_mesh(_save(tmp_path, tree)).parts
    uv = uv_of(part)
    assert uv is not None and uv[:, 0].min() == pytest.approx(5)


def test_instances_that_are_left_out_are_said(tmp_path: Path) -> None:
    maker = Maker()
    tree = maker.scene(_triangle(maker), extensions={"EXT_mesh_gpu_instancing": {"attributes": {}}})
    assert read_mesh(_save(tmp_path, tree)).findings == [
        "instances of a mesh in it (EXT_mesh_gpu_instancing) were left out: it was taken once"
    ]
