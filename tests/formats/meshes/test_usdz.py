from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdUtils

from manitwin.errors import InputError
from manitwin.formats.isolated import run_isolated
from manitwin.formats.meshes import read
from manitwin.formats.meshes.read import read_mesh

POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


def _material(stage: Usd.Stage, texture: str) -> UsdShade.Material:
    material = UsdShade.Material.Define(stage, "/root/skin")
    surface = UsdShade.Shader.Define(stage, "/root/skin/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    surface.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(0.25)
    surface.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(1.0)
    reader = UsdShade.Shader.Define(stage, "/root/skin/texture")
    reader.CreateIdAttr("UsdUVTexture")
    reader.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(texture)
    color = surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    color.ConnectToSource(reader.ConnectableAPI(), "rgb")
    material.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
    return material


def _square(stage: Usd.Stage, name: str) -> UsdGeom.Mesh:
    mesh = UsdGeom.Mesh.Define(stage, f"/root/{name}")
    mesh.CreatePointsAttr([Gf.Vec3f(*p) for p in POINTS])
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying
    )
    primvar.Set([Gf.Vec2f(*p[:2]) for p in POINTS])
    return mesh


def _stage(folder: Path, texture: str = "skin.png") -> Path:
    stage = Usd.Stage.CreateNew(str(folder / "a.usdc"))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.Xform.Define(stage, "/root")
    material = _material(stage, texture)
    first, second = _square(stage, "first"), _square(stage, "second")
    UsdGeom.XformCommonAPI(second).SetTranslate((5, 0, 0))
    UsdGeom.XformCommonAPI(second).SetScale((-2, 1, 1))
    for mesh in (first, second):
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    hidden = _square(stage, "hidden")
    UsdGeom.Imageable(hidden).MakeInvisible()
    stage.Save()
    return folder / "a.usdc"


def _package(path: Path, members: dict[str, bytes], compression: int = zipfile.ZIP_STORED) -> Path:
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return path


@pytest.fixture
def usdz(tmp_path: Path) -> Path:
    Image.new("RGB", (2, 2), (1, 2, 3)).save(tmp_path / "skin.png")
    _stage(tmp_path)
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "a.usdc"), str(tmp_path / "a.usdz"))
    (tmp_path / "skin.png").unlink()
    return tmp_path / "a.usdz"


def test_meshes_units_axis_and_textures_of_a_package_are_read(usdz: Path) -> None:
    mesh = read_mesh(usdz)
    assert (mesh.format, mesh.unit_m, mesh.up) == ("usdz", 0.01, "z")
    first, second = mesh.parts
    np.testing.assert_allclose(first.bounds, [[0, 0, 0], [1, 1, 0]], atol=1e-6)
    np.testing.assert_allclose(second.bounds, [[3, 0, 0], [5, 1, 0]], atol=1e-6)
    np.testing.assert_allclose(first.face_normals, [[0, 0, 1]] * 2, atol=1e-6)
    np.testing.assert_allclose(second.face_normals, [[0, 0, 1]] * 2, atol=1e-6)
    material = first.visual.material
    assert material.baseColorTexture.getpixel((0, 0)) == (1, 2, 3)
    assert (material.metallicFactor, material.roughnessFactor) == (1.0, 0.25)
    by_corner = {tuple(v[:2]): tuple(uv) for v, uv in zip(first.vertices, first.visual.uv, strict=True)}
    assert by_corner == {(0, 0): (0, 0), (1, 0): (1, 0), (1, 1): (1, 1), (0, 1): (0, 1)}
    assert mesh.findings == ["hidden, guide or proxy meshes in it were left out"]


def test_texture_outside_the_package_is_never_read(tmp_path: Path) -> None:
    Image.new("RGB", (2, 2)).save(tmp_path / "secret.png")
    for number, name in enumerate(("../secret.png", str(tmp_path / "secret.png"))):
        layer = _stage(tmp_path, texture=name).read_bytes()
        (tmp_path / "a.usdc").unlink()
        mesh = read_mesh(_package(tmp_path / f"{number}.usdz", {"a.usdc": layer}))
        assert mesh.parts[0].visual.material.baseColorTexture is None
        assert any("texture" in finding for finding in mesh.findings)
        assert tuple(mesh.parts[0].visual.material.baseColorFactor[:3]) == (204, 204, 204), (
            "not USD's own default, dark grey"
        )


def test_layer_outside_the_package_is_refused(tmp_path: Path) -> None:
    secret = Usd.Stage.CreateNew(str(tmp_path / "secret.usda"))
    secret.SetDefaultPrim(UsdGeom.Xform.Define(secret, "/root").GetPrim())
    _square(secret, "first")
    secret.Save()
    (tmp_path / "inputs").mkdir()
    for number, name in enumerate(("../secret.usda", str(tmp_path / "secret.usda"))):
        text = f'#usda 1.0\ndef Xform "root" (prepend references = @{name}@) {{}}\n'
        path = _package(tmp_path / "inputs" / f"{number}.usdz", {"root.usda": text.encode()})
        with pytest.raises(InputError, match="not in the archive"):
            read_mesh(path)


def test_compressed_members_are_refused(tmp_path: Path) -> None:
    bomb = b"#usda 1.0\n# " + b"0" * 10_000_000
    path = _package(tmp_path / "a.usdz", {"root.usda": bomb}, zipfile.ZIP_DEFLATED)
    assert path.stat().st_size < 100_000
    with pytest.raises(InputError, match="compressed"):
        read_mesh(path)


def test_member_that_leads_out_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="leads out"):
        read_mesh(_package(tmp_path / "a.usdz", {"root.usda": b"#usda 1.0\n", "../evil.png": b"x"}))


def test_cut_and_broken_packages_are_unreadable(usdz: Path) -> None:
    data = usdz.read_bytes()
    for share in (0.3, 0.6, 0.95):
        cut = usdz.with_name(f"cut{int(share * 100)}.usdz")
        cut.write_bytes(data[: int(len(data) * share)])
        with pytest.raises(InputError) as caught:
            read_mesh(cut)
        assert caught.value.reason == "unreadable"
    broken = _package(usdz.with_name("broken.usdz"), {"root.usda": b"#usda 1.0\ndef Mesh { nonsense"})
    with pytest.raises(InputError, match="cannot be read"):
        read_mesh(broken)


def test_layer_that_crashes_the_usd_library_is_only_unreadable(usdz: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(read, "run_isolated", lambda *_: run_isolated("os:abort"))
    with pytest.raises(InputError, match="crashes"):
        read_mesh(usdz)
    monkeypatch.undo()
    assert len(read_mesh(usdz).parts) == 2


def test_the_usd_library_is_not_loaded_into_the_process_that_reads(usdz: Path) -> None:
    code = f"""
import sys
from pathlib import Path
from manitwin.formats.isolated import run_isolated
from manitwin.formats.meshes import read
from manitwin.formats.meshes.read import read_mesh
assert len(read_mesh(Path({str(usdz)!r})).parts) == 2
assert not any(name.startswith("pxr") for name in sys.modules)
"""
    subprocess.run([sys.executable, "-c", code], check=True)
