"""The files of the fake generators: what they hold is what their names say, by readers that did not write them."""

from __future__ import annotations

import io
import json
import struct
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from pxr import Usd, UsdGeom

from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh
from manitwin.models.fakes.faults import FAULTS, Faults
from manitwin.models.fakes.meshes import (
    BODY,
    FAULTY,
    body_and_cap,
    bottle,
    glb,
    mesh_file,
    open_surface,
    usdz,
    webp_glb,
)


def _json(data: bytes) -> dict:
    return json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])


def _welded(vertices: np.ndarray, faces: np.ndarray) -> trimesh.Trimesh:
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    return mesh


def test_bottle_is_a_closed_solid_of_the_volume_of_its_profile() -> None:
    surface = bottle()
    mesh = _welded(surface.vertices, surface.faces)
    assert mesh.is_watertight and mesh.is_winding_consistent and 4500 < len(surface.faces) < 5500
    # a body without neck and cap is less, a cylinder around all of it more
    body = sum(np.pi / 3 * (h1 - h0) * (r0**2 + r0 * r1 + r1**2) for (r0, h0), (r1, h1) in pairwise(BODY))
    assert 0.99 * body < mesh.volume < np.pi * 0.17**2
    assert surface.vertices.min(0) == pytest.approx([-0.17, 0, -0.17]) and surface.vertices[:, 1].max() == 1.0
    assert surface.uv.min() >= 0 and surface.uv.max() <= 1 and len(surface.uv) == len(surface.vertices)


def test_body_and_cap_are_two_solids_that_do_not_touch() -> None:
    body, cap = (_welded(s.vertices, s.faces) for s in body_and_cap())
    assert body.is_watertight and cap.is_watertight and body.volume > 0 and cap.volume > 0
    assert body.bounds[1, 1] < cap.bounds[0, 1]


def test_seed_gives_the_colour() -> None:
    assert glb([bottle(1)]) != glb([bottle(2)]) and glb([bottle(1)]) == glb([bottle(1)])
    assert not np.array_equal(bottle(1).texture, bottle(2).texture)


def test_glb_is_as_trimesh_reads_it(tmp_path: Path) -> None:
    (tmp_path / "b.glb").write_bytes(glb([bottle()]))
    scene = trimesh.load_scene(tmp_path / "b.glb")
    (mesh,) = scene.geometry.values()
    assert mesh.extents == pytest.approx([0.34, 1.0, 0.34], abs=1e-6)
    assert mesh.visual.material.baseColorTexture.size == (256, 256)


def test_usdz_is_as_the_usd_library_reads_it(tmp_path: Path) -> None:
    (tmp_path / "b.usdz").write_bytes(usdz(body_and_cap()))
    assert (tmp_path / "b.usdz").read_bytes() == usdz(body_and_cap())
    stage = Usd.Stage.Open(str(tmp_path / "b.usdz"))
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert [prim.GetName() for prim in meshes] == ["body", "cap"]
    assert UsdGeom.GetStageUpAxis(stage) == "Y"


def test_webp_texture_is_the_only_one(tmp_path: Path) -> None:
    data = webp_glb()
    tree = _json(data)
    assert tree["extensionsRequired"] == ["EXT_texture_webp"] and "source" not in tree["textures"][0]
    view = tree["bufferViews"][tree["images"][0]["bufferView"]]
    start = 28 + struct.unpack_from("<I", data, 12)[0] + view["byteOffset"]
    assert Image.open(io.BytesIO(data[start : start + view["byteLength"]])).format == "WEBP"
    (tmp_path / "w.glb").write_bytes(data)
    (part,) = read_mesh(tmp_path / "w.glb").parts
    assert part.visual.material.baseColorTexture.size == (256, 256)


def test_open_surface_is_of_scraps() -> None:
    surface = open_surface()
    assert len(surface.faces) * 3 == len(surface.vertices)
    assert not _welded(surface.vertices, surface.faces).is_watertight


def test_every_fault_of_meshes_makes_what_it_says(tmp_path: Path) -> None:
    assert set(FAULTY) < set(FAULTS)
    extents, refused = {}, {}
    for fault in FAULTY:
        faults = Faults({fault: 1})
        path = tmp_path / f"{fault}.glb"
        path.write_bytes(mesh_file("glb", faults))
        assert mesh_file("glb", faults) == glb([bottle()]), "a fault that has struck is over"
        try:
            parts = read_mesh(path).parts
            extents[fault] = np.ptp(np.vstack([part.vertices for part in parts]), axis=0).round(3).tolist()
            assert len(parts) == (2 if fault == "two_meshes" else 1)
        except InputError as error:
            refused[fault] = error.detail
    assert extents["webp_texture"] == extents["two_meshes"] == [0.34, 1.0, 0.34]
    assert extents["z_up_mesh"] == [0.34, 0.34, 1.0]
    assert set(refused) == {"empty_mesh", "truncated_mesh", "draco_mesh"}
    assert "zero bytes" in refused["empty_mesh"] and "truncated" in refused["truncated_mesh"]
    assert "KHR_draco_mesh_compression" in refused["draco_mesh"]
