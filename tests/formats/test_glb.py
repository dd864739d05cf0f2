from __future__ import annotations

import io
import json
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.formats.glb import read_glb, write_glb
from manitwin.formats.meshes.textures import make_part, pbr_material


def _texture(size: tuple[int, int] = (64, 32), mode: str = "RGB") -> Image.Image:
    x, y = np.meshgrid(np.linspace(0, 255, size[0]), np.linspace(0, 255, size[1]))
    bands = [x, y, 255 - x] + ([y] if mode == "RGBA" else [])
    return Image.fromarray(np.stack(bands, -1).astype(np.uint8), mode=None)


def _parts(texture: Image.Image | None = None, alpha_mode: str | None = None) -> list[trimesh.Trimesh]:
    box = trimesh.creation.box(extents=(0.1, 0.2, 0.3))
    box.apply_translation((0, 0, 0.15))
    uv = np.random.default_rng(0).random((len(box.vertices), 2))
    textured = pbr_material(
        "skin", base_color=(1, 1, 1, 1), metallic=0.25, roughness=0.5, base_color_texture=texture or _texture(),
        normal_texture=Image.new("RGB", (8, 8), (128, 128, 255)), alpha_mode=alpha_mode,
    )  # fmt: skip
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.05)
    return [
        make_part(box.vertices, box.faces, material=textured, name="a box", uv=uv, normals=box.vertex_normals),
        make_part(ball.vertices, ball.faces, material=pbr_material(base_color=(1, 0, 0)), name="a ball"),
    ]


def _tree(data: bytes) -> dict:
    return json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])


def test_round_trip_keeps_geometry_names_and_materials(tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(write_glb(_parts()))
    for before, after in zip(_parts(), read_glb(tmp_path / "a.glb"), strict=True):
        np.testing.assert_allclose(after.vertices, before.vertices, atol=1e-7)
        np.testing.assert_array_equal(after.faces, before.faces)
        np.testing.assert_allclose(after.vertex_normals, before.vertex_normals, atol=1e-6)
        assert after.metadata["name"] == before.metadata["name"]
        mine, other = before.visual.material, after.visual.material
        assert (other.metallicFactor, other.roughnessFactor) == (mine.metallicFactor, mine.roughnessFactor)
        np.testing.assert_array_equal(other.baseColorFactor, mine.baseColorFactor)
        if before.visual.uv is not None:
            np.testing.assert_allclose(after.visual.uv, before.visual.uv, atol=1e-6)
            error = np.abs(np.asarray(other.baseColorTexture, float) - np.asarray(mine.baseColorTexture, float))
            assert error.mean() < 2.0
            assert other.normalTexture.getpixel((0, 0)) == pytest.approx((128, 128, 255), abs=2)


def test_trimesh_reads_the_same_thing_y_up() -> None:
    scene = trimesh.load_scene(io.BytesIO(write_glb(_parts()[:1])), file_type="glb")
    (mesh,) = scene.dump()
    np.testing.assert_allclose(mesh.bounds, [[-0.05, 0, -0.1], [0.05, 0.3, 0.1]], atol=1e-7)
    assert mesh.volume == pytest.approx(0.1 * 0.2 * 0.3)
    assert mesh.visual.material.baseColorTexture.size == (64, 32)


def test_object_x_is_gltf_x_and_object_y_is_gltf_minus_z() -> None:
    part = make_part(
        np.array([[1.0, 2, 3], [0, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]), material=pbr_material(), name="p"
    )
    data = write_glb([part])
    accessor = _tree(data)["accessors"][0]
    assert (accessor["min"], accessor["max"]) == ([0, 0, -2], [1, 3, 0])


def test_same_parts_give_the_same_bytes() -> None:
    assert write_glb(_parts()) == write_glb(_parts())


def test_shared_texture_is_stored_once() -> None:
    part = _parts()[0]
    one, two = write_glb([part]), write_glb([part, part.copy()])
    assert len(_tree(two)["images"]) == len(_tree(one)["images"]) == 2


def test_textures_of_one_size_are_told_apart_by_their_pixels() -> None:
    first, other = _texture(), Image.fromarray(255 - np.asarray(_texture()))
    parts = [_parts(each)[0] for each in (first, other, first.copy(), other.copy(), first)]
    tree = _tree(write_glb(parts))
    materials = [tree["materials"][mesh["primitives"][0]["material"]] for mesh in tree["meshes"]]
    textures = [each["pbrMetallicRoughness"]["baseColorTexture"]["index"] for each in materials]
    sources = [tree["textures"][each]["source"] for each in textures]
    assert sources == [sources[0], sources[1]] * 2 + [sources[0]] and sources[0] != sources[1]
    assert len(tree["images"]) == 3


@pytest.mark.parametrize("size", [(128, 64), (100, 36)])
def test_large_textures_are_scaled_down(size: tuple[int, int]) -> None:
    data = write_glb(_parts(_texture(size)), max_texture_size=32)
    (mesh,) = [
        m for m in trimesh.load_scene(io.BytesIO(data), file_type="glb").dump() if m.visual.material.name == "skin"
    ]
    assert max(mesh.visual.material.baseColorTexture.size) == 32


def test_alpha_survives_only_where_it_counts() -> None:
    mimes = [
        [image["mimeType"] for image in _tree(write_glb(_parts(_texture(mode="RGBA"), mode)))["images"]]
        for mode in (None, "BLEND")
    ]
    assert mimes == [["image/jpeg", "image/jpeg"], ["image/png", "image/jpeg"]]


def test_sapien_loads_the_file(tmp_path: Path) -> None:
    sapien = pytest.importorskip("sapien")
    (tmp_path / "a.glb").write_bytes(write_glb(_parts()))
    mesh = sapien.render.RenderShapeTriangleMesh(str(tmp_path / "a.glb"))
    points = np.vstack([part.vertices for part in mesh.parts])
    np.testing.assert_allclose([points.min(0), points.max(0)], [[-0.05, -0.05, -0.1], [0.05, 0.3, 0.1]], atol=1e-6)
