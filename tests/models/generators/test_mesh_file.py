"""Generated files become GLB without losing meshes, textures or size."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manitwin.errors import BadReply
from manitwin.formats.glb import read_glb
from manitwin.formats.meshes.read import read_mesh
from manitwin.models.fakes.meshes import body_and_cap, bottle, glb, truncated, usdz, webp_glb
from manitwin.models.generators.mesh_file import as_glb


def test_glb_stays_as_it_is_whatever_it_is_called(tmp_path: Path) -> None:
    (tmp_path / "made.usdz").write_bytes(webp_glb())
    assert as_glb(tmp_path / "made.usdz") == webp_glb()


def test_usdz_with_two_meshes_keeps_both_with_their_textures(tmp_path: Path) -> None:
    body, cap = body_and_cap(3)
    (tmp_path / "made.usdz").write_bytes(usdz([body, cap]))
    (tmp_path / "generated.glb").write_bytes(as_glb(tmp_path / "made.usdz"))
    file = read_mesh(tmp_path / "generated.glb")
    assert file.up == "y" and [part.metadata["name"] for part in file.parts] == ["body", "cap"]
    for part, surface in zip(file.parts, (body, cap), strict=True):
        assert np.ptp(part.vertices, axis=0) == pytest.approx(np.ptp(surface.vertices, axis=0), abs=1e-6)
        texture = np.asarray(part.visual.material.baseColorTexture.convert("RGB")).astype(int)
        assert np.abs(texture - surface.texture).mean() < 3  # JPEG
        assert part.visual.material.roughnessFactor == pytest.approx(0.55)
    parts = read_glb(tmp_path / "generated.glb")
    assert max(part.vertices[:, 2].max() for part in parts) == pytest.approx(1.0)  # object frame: Z up


def test_unit_of_a_usdz_is_minded(tmp_path: Path) -> None:
    from pxr import Usd, UsdGeom, UsdUtils

    stage = Usd.Stage.CreateNew(str(tmp_path / "cm.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    surface = bottle()
    mesh = UsdGeom.Mesh.Define(stage, "/bottle")
    mesh.CreatePointsAttr((surface.vertices[:, [2, 0, 1]] * 20).tolist())
    mesh.CreateFaceVertexCountsAttr([3] * len(surface.faces))
    mesh.CreateFaceVertexIndicesAttr(surface.faces.reshape(-1).tolist())
    stage.GetRootLayer().Save()
    UsdUtils.CreateNewUsdzPackage(str(tmp_path / "cm.usda"), str(tmp_path / "cm.usdz"))
    (tmp_path / "m.glb").write_bytes(as_glb(tmp_path / "cm.usdz"))
    (part,) = read_glb(tmp_path / "m.glb")
    assert part.extents == pytest.approx([0.068, 0.068, 0.2], abs=1e-6)


def test_broken_file_is_a_bad_reply(tmp_path: Path) -> None:
    (tmp_path / "made.usdz").write_bytes(truncated(usdz([bottle()])))
    with pytest.raises(BadReply, match=r"made\.usdz"):
        as_glb(tmp_path / "made.usdz")
    (tmp_path / "empty.glb").write_bytes(b"")
    with pytest.raises(BadReply, match="zero bytes"):
        as_glb(tmp_path / "empty.glb")
    assert glb([bottle()])[:4] == b"glTF"
