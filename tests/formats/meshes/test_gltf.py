from __future__ import annotations

import base64
import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh

POSITIONS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype="<f4")
TYPES = {np.dtype("<f4"): 5126, np.dtype("<u2"): 5123, np.dtype("u1"): 5121, np.dtype("<u4"): 5125}


class Maker:
    """A glTF document built by hand, so that nothing of the reader is used to test the reader."""

    def __init__(self) -> None:
        self.tree: dict[str, Any] = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": [], "buffers": []}

    def array(self, values: np.ndarray, type: str, **more: Any) -> int:
        data = values.tobytes()
        uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
        self.tree["buffers"].append({"byteLength": len(data), "uri": uri})
        self.tree["bufferViews"].append({"buffer": len(self.tree["buffers"]) - 1, "byteLength": len(data)})
        view = len(self.tree["bufferViews"]) - 1
        accessor = {
            "bufferView": view,
            "componentType": TYPES[values.dtype],
            "count": len(values),
            "type": type,
            **more,
        }
        self.tree["accessors"].append(accessor)
        return len(self.tree["accessors"]) - 1

    def scene(self, primitive: dict[str, Any], **node: Any) -> dict[str, Any]:
        self.tree |= {"meshes": [{"primitives": [primitive]}], "nodes": [{"mesh": 0, **node}]}
        self.tree |= {"scenes": [{"nodes": [0]}], "scene": 0}
        return self.tree


def _save(tmp_path: Path, tree: dict[str, Any]) -> Path:
    (tmp_path / "a.gltf").write_text(json.dumps(tree))
    return tmp_path / "a.gltf"


def _triangle(maker: Maker) -> dict[str, Any]:
    order = maker.array(np.array([0, 1, 2], dtype="<u2"), "SCALAR")
    return {"attributes": {"POSITION": maker.array(POSITIONS, "VEC3")}, "indices": order}


def test_mirrored_node_keeps_the_surface_facing_outward(tmp_path: Path) -> None:
    box = trimesh.creation.box()
    maker = Maker()
    primitive = {
        "attributes": {"POSITION": maker.array(np.asarray(box.vertices, "<f4"), "VEC3")},
        "indices": maker.array(np.asarray(box.faces.reshape(-1), "<u2"), "SCALAR"),
    }
    tree = maker.scene(primitive, scale=[-2, 1, 1], translation=[5, 0, 0], rotation=[0, 0, np.sin(0.4), np.cos(0.4)])
    (part,) = read_mesh(_save(tmp_path, tree)).parts
    assert part.volume == pytest.approx(2.0)
    np.testing.assert_allclose(part.center_mass, [5, 0, 0], atol=1e-6)


def test_child_transform_is_applied_before_its_parent(tmp_path: Path) -> None:
    maker = Maker()
    tree = maker.scene(_triangle(maker))
    tree["nodes"] = [
        {"children": [1], "translation": [10, 0, 0]},
        {"mesh": 0, "matrix": np.diag([2.0, 2, 2, 1]).ravel().tolist()},
    ]
    (part,) = read_mesh(_save(tmp_path, tree)).parts
    np.testing.assert_allclose(part.bounds, [[10, 0, 0], [12, 2, 0]], atol=1e-6)


def test_normalised_integer_texture_coordinates_become_fractions(tmp_path: Path) -> None:
    maker = Maker()
    primitive = _triangle(maker)
    uv = np.array([[0, 0], [65535, 0], [0, 65535], [65535, 65535]], dtype="<u2")
    primitive["attributes"]["TEXCOORD_0"] = maker.array(uv, "VEC2", normalized=True)
    (part,) = read_mesh(_save(tmp_path, maker.scene(primitive))).parts
    by_corner = {tuple(v[:2]): tuple(uv) for v, uv in zip(part.vertices.round(3), part.visual.uv.round(3), strict=True)}
    assert by_corner[(0, 0)] == (0, 1) and by_corner[(1, 0)] == (1, 1) and by_corner[(0, 1)] == (0, 0)


@pytest.mark.parametrize(("mode", "area"), [(5, 1.0), (6, 0.5 + 0.5)])
def test_strips_and_fans_cover_the_square_one_way_up(tmp_path: Path, mode: int, area: float) -> None:
    maker = Maker()
    order = [0, 1, 2, 3] if mode == 5 else [0, 1, 3, 2]
    primitive = _triangle(maker)
    primitive |= {"indices": maker.array(np.array(order, dtype="<u2"), "SCALAR"), "mode": mode}
    (part,) = read_mesh(_save(tmp_path, maker.scene(primitive))).parts
    assert part.area == pytest.approx(area)
    np.testing.assert_allclose(part.face_normals, [[0, 0, 1], [0, 0, 1]])


def test_sparse_accessor_moves_its_vertices(tmp_path: Path) -> None:
    maker = Maker()
    primitive = _triangle(maker)
    where, news = (
        maker.array(np.array([1], dtype="<u2"), "SCALAR"),
        maker.array(np.array([[3, 0, 0]], dtype="<f4"), "VEC3"),
    )
    views = [maker.tree["accessors"][i]["bufferView"] for i in (where, news)]
    position = maker.tree["accessors"][primitive["attributes"]["POSITION"]]
    position["sparse"] = {
        "count": 1,
        "indices": {"bufferView": views[0], "componentType": 5123},
        "values": {"bufferView": views[1]},
    }
    (part,) = read_mesh(_save(tmp_path, maker.scene(primitive))).parts
    assert part.area == pytest.approx(1.5)


def test_linear_vertex_colours_become_an_srgb_texture(tmp_path: Path) -> None:
    maker = Maker()
    primitive = _triangle(maker)
    half_grey = np.full((4, 3), 0.2140, dtype="<f4")  # sRGB 127.5
    primitive["attributes"]["COLOR_0"] = maker.array(half_grey, "VEC3")
    (part,) = read_mesh(_save(tmp_path, maker.scene(primitive))).parts
    assert part.visual.material.baseColorTexture.getpixel((0, 0)) == pytest.approx((127, 127, 127), abs=1)


def test_missing_factors_are_those_of_the_specification(tmp_path: Path) -> None:
    maker = Maker()
    tree = maker.scene({**_triangle(maker), "material": 0})
    tree["materials"] = [{"pbrMetallicRoughness": {}}]
    material = read_mesh(_save(tmp_path, tree)).parts[0].visual.material
    assert (material.metallicFactor, material.roughnessFactor) == (1.0, 1.0)


def test_texture_transform_moves_the_coordinates(tmp_path: Path) -> None:
    stream = io.BytesIO()
    Image.new("RGB", (2, 2), (0, 255, 0)).save(stream, "PNG")
    maker = Maker()
    primitive = {**_triangle(maker), "material": 0}
    primitive["attributes"]["TEXCOORD_0"] = maker.array(np.array([[0, 0], [1, 0], [0, 1], [1, 1]], dtype="<f4"), "VEC2")
    tree = maker.scene(primitive)
    info = {"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.25, 0.5], "scale": [0.5, 0.5]}}}
    tree |= {"materials": [{"pbrMetallicRoughness": {"baseColorTexture": info}}], "textures": [{"source": 0}]}
    tree["images"] = [{"uri": "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()}]
    (part,) = read_mesh(_save(tmp_path, tree)).parts
    by_corner = {tuple(v[:2]): tuple(uv) for v, uv in zip(part.vertices.round(3), part.visual.uv.round(3), strict=True)}
    assert by_corner[(0, 0)] == (0.25, 0.5) and by_corner[(1, 0)] == (0.75, 0.5)


@pytest.mark.parametrize(("factor", "kept"), [([1, 1, 1, 1], (204, 204, 204)), ([1, 0, 0, 1], (255, 0, 0))])
def test_material_whose_texture_is_lost_is_grey_unless_it_has_a_tint(
    tmp_path: Path, factor: list[float], kept: tuple[int, ...]
) -> None:
    maker = Maker()
    tree = maker.scene({**_triangle(maker), "material": 0})
    pbr = {"baseColorTexture": {"index": 0}, "baseColorFactor": factor}
    tree |= {"materials": [{"name": "paint", "pbrMetallicRoughness": pbr}], "textures": [{"source": 0}]}
    mesh = read_mesh(_save(tmp_path, tree | {"images": [{"uri": "gone.png"}]}))
    assert tuple(mesh.parts[0].visual.material.baseColorFactor[:3]) == kept
    assert mesh.findings == ["texture 'gone.png' is not there; carried on without it"]


def test_animation_is_told_and_its_rest_pose_taken(tmp_path: Path) -> None:
    maker = Maker()
    tree = maker.scene(_triangle(maker))
    tree["animations"] = [{"channels": [], "samplers": []}]
    assert read_mesh(_save(tmp_path, tree)).findings == ["the file is animated; its rest pose was taken"]


def _break(tree: dict[str, Any], how: str) -> None:
    if how == "cycle":
        tree["nodes"][0]["children"] = [0]
    elif how == "absurd count":
        tree["accessors"][0]["count"] = 2**40
    elif how == "short view":
        tree["accessors"][0]["count"] = 1000
    elif how == "short buffer":
        tree["buffers"][0]["byteLength"] = 10**9
    elif how == "index out of range":
        tree["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 77
    elif how == "unknown extension":
        tree["extensionsRequired"] = ["XX_no_such_extension"]
    elif how == "version":
        tree["asset"]["version"] = "1.0"
    elif how == "outside buffer":
        tree["buffers"][0]["uri"] = "../secret.bin"
    elif how == "remote buffer":
        tree["buffers"][0]["uri"] = "http://localhost/x.bin"
    elif how == "negative stride":
        tree["bufferViews"][0]["byteStride"] = -4
    elif how == "matrix":
        tree["nodes"][0]["matrix"] = [1, 2, 3]
    elif how == "huge scale":
        tree["nodes"][0]["scale"] = [10**400, 1, 1]


@pytest.mark.parametrize(
    "how",
    ["cycle", "absurd count", "short view", "short buffer", "index out of range", "unknown extension", "version",
     "outside buffer", "remote buffer", "negative stride", "matrix", "huge scale"],
)  # fmt: skip
def test_hostile_documents_are_unreadable_in_one_line(tmp_path: Path, how: str) -> None:
    folder = tmp_path / "inputs"
    folder.mkdir()
    (tmp_path / "secret.bin").write_bytes(bytes(1000))
    maker = Maker()
    tree = maker.scene(_triangle(maker))
    _break(tree, how)
    with pytest.raises(InputError) as caught:
        read_mesh(_save(folder, tree))
    assert caught.value.reason == ("too_large" if how == "absurd count" else "unreadable")
    assert caught.value.detail.startswith("a.gltf: ") and "\n" not in caught.value.detail


def test_glb_with_a_chunk_longer_than_the_file_is_truncated(tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(struct.pack("<4sIIII", b"glTF", 2, 10**6, 10**6, 0x4E4F534A) + b"{}")
    with pytest.raises(InputError, match="truncated"):
        read_mesh(tmp_path / "a.glb")
