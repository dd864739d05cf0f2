"""The mesh files that generators make: which of them become twins, and how they become GLB."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from manitwin.errors import BadReply
from manitwin.formats.glb import read_glb
from manitwin.formats.meshes.read import read_mesh
from manitwin.models.fakes.meshes import (
    TexturedMesh,
    body_and_cap,
    bottle,
    draco_glb,
    glb,
    open_surface,
    truncated,
    usdz,
    webp_glb,
)
from manitwin.models.generators.generated_mesh import convert_to_glb, find_flaw


def _flaw(tmp_path: Path, data: bytes, name: str = "made.glb") -> str | None:
    (tmp_path / name).write_bytes(data)
    return find_flaw(tmp_path / name)


def _with(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    whole = bottle()
    return glb([TexturedMesh("x", vertices, faces, np.zeros((len(vertices), 2)), whole.texture)])


def test_whole_meshes_pass(tmp_path: Path) -> None:
    assert _flaw(tmp_path, glb([bottle()])) is None
    assert _flaw(tmp_path, webp_glb()) is None
    assert _flaw(tmp_path, glb(body_and_cap())) is None
    assert _flaw(tmp_path, glb([bottle()], up="z")) is None
    assert _flaw(tmp_path, usdz([bottle()]), "made.usdz") is None


def test_mesh_with_a_hole_and_a_bowl_without_thickness_pass(tmp_path: Path) -> None:
    whole = bottle()
    assert _flaw(tmp_path, _with(whole.vertices, whole.faces[50:])) is None
    sphere = trimesh.creation.icosphere(3)
    bowl = sphere.faces[(sphere.vertices[sphere.faces][:, :, 1] < 0.1).all(1)]
    assert _flaw(tmp_path, _with(np.asarray(sphere.vertices), bowl)) is None


def test_both_sides_of_a_surface_pass(tmp_path: Path) -> None:
    whole = bottle()
    assert _flaw(tmp_path, _with(whole.vertices, np.concatenate([whole.faces, whole.faces[:, ::-1]]))) is None


@pytest.mark.parametrize("scraps", [60, 200, 400, 1000])
def test_scraps_are_refused(tmp_path: Path, scraps: int) -> None:
    whole = bottle()
    rows = whole.faces[np.random.default_rng(scraps).choice(len(whole.faces), scraps, replace=False)].reshape(-1)
    wrong = _flaw(tmp_path, _with(whole.vertices[rows], np.arange(len(rows)).reshape(-1, 3)))
    assert wrong is not None and wrong.startswith("made.glb: ")


def test_words_of_each_refusal(tmp_path: Path) -> None:
    whole = bottle()
    assert "KHR_draco_mesh_compression" in str(_flaw(tmp_path, draco_glb()))
    assert "truncated" in str(_flaw(tmp_path, truncated(glb([whole]))))
    assert "zero bytes" in str(_flaw(tmp_path, b""))
    assert "watertight" in str(_flaw(tmp_path, glb([open_surface()])))
    assert "all of its vertices coincide" in str(_flaw(tmp_path, _with(whole.vertices * 0, whole.faces)))
    flat = str(_flaw(tmp_path, _with(whole.vertices * [1, 1, 0], whole.faces)))
    assert "watertight" in flat or "volume" in flat
    nan = whole.vertices.copy()
    nan[100] = np.nan
    assert "NaN" in str(_flaw(tmp_path, _with(nan, whole.faces)))


def test_glb_stays_as_it_is_whatever_it_is_called(tmp_path: Path) -> None:
    (tmp_path / "made.usdz").write_bytes(webp_glb())
    assert convert_to_glb(tmp_path / "made.usdz") == webp_glb()


def test_usdz_with_two_meshes_keeps_both_with_their_textures(tmp_path: Path) -> None:
    body, cap = body_and_cap(3)
    (tmp_path / "made.usdz").write_bytes(usdz([body, cap]))
    (tmp_path / "generated.glb").write_bytes(convert_to_glb(tmp_path / "made.usdz"))
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
    (tmp_path / "m.glb").write_bytes(convert_to_glb(tmp_path / "cm.usdz"))
    (part,) = read_glb(tmp_path / "m.glb")
    assert part.extents == pytest.approx([0.068, 0.068, 0.2], abs=1e-6)


def test_broken_file_is_a_bad_reply(tmp_path: Path) -> None:
    (tmp_path / "made.usdz").write_bytes(truncated(usdz([bottle()])))
    with pytest.raises(BadReply, match=r"made\.usdz"):
        convert_to_glb(tmp_path / "made.usdz")
    (tmp_path / "empty.glb").write_bytes(b"")
    with pytest.raises(BadReply, match="zero bytes"):
        convert_to_glb(tmp_path / "empty.glb")
    assert glb([bottle()])[:4] == b"glTF"
