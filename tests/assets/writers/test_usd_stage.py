"""The USD export, read back by USD's own classes, its validators, and its text."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, UsdValidation
from scipy.spatial.transform import Rotation

from exported_twins import (
    BASE_COLOR_LINEAR,
    CENTER_OF_MASS_M,
    DYNAMIC,
    INERTIA_KG_M2,
    MASS_KG,
    NAME,
    RESTITUTION,
    STATIC,
    content,
    hulls,
    visual_parts,
)
from manitwin.assets.writers import usd
from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.usd_materials import GlbImages


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> TwinContent:
    return content(tmp_path_factory.mktemp("usd") / "twin")


@pytest.fixture(scope="module", params=[usd.export, usd.export_usdz], ids=["usd", "usdz"])
def main(request: pytest.FixtureRequest, twin: TwinContent, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The exported stage's file."""
    folder = tmp_path_factory.mktemp("exported")
    exported = request.param(twin)
    write(exported, folder)
    return folder / exported.main


@pytest.fixture
def stage(main: Path) -> Usd.Stage:
    return Usd.Stage.Open(str(main))


def write(exported: Exported, folder: Path) -> None:
    for name, data in exported.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


def complaints(stage: Usd.Stage) -> list[str]:
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) >= 30
    return [error.GetMessage() for error in UsdValidation.ValidationContext(validators).Validate(stage)]


def test_no_validator_of_usd_complains(stage: Usd.Stage) -> None:
    assert complaints(stage) == []


def test_validators_do_complain_of_an_export_that_is_spoilt(stage: Usd.Stage) -> None:
    spoilt = Usd.Stage.CreateInMemory()
    spoilt.GetRootLayer().TransferContent(stage.Flatten())
    root = spoilt.GetDefaultPrim()
    UsdPhysics.RigidBodyAPI.Apply(root.GetChild("materials"))  # a scope has no place to move from
    hull = UsdGeom.Mesh(root.GetChild("collision").GetChildren()[0])
    hull.GetPrim().RemoveAPI(UsdShade.MaterialBindingAPI)
    spoilt.GetRootLayer().ClearDefaultPrim()
    found = complaints(spoilt)
    for word in ("Rigid body API", "MaterialBindingAPI", "defaultPrim"):
        assert any(word in each for each in found), (word, found)


def test_stage_is_metric_upright_and_one_component(stage: Usd.Stage) -> None:
    root = stage.GetDefaultPrim()
    assert (UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage)) == (1.0, "Z")
    assert UsdPhysics.GetStageKilogramsPerUnit(stage) == 1.0
    assert (root.GetName(), root.GetTypeName(), Usd.ModelAPI(root).GetKind()) == (NAME, "Xform", "component")
    assert all(prim.GetTypeName() for prim in stage.Traverse())
    assert not any(prim.IsA(UsdPhysics.Scene) for prim in stage.Traverse())
    assert [prim for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.RigidBodyAPI)] == [root]
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Imageable):
            world = UsdGeom.Imageable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
            assert world == Gf.Matrix4d(1), prim.GetPath()


def test_mass_properties_are_the_twins(stage: Usd.Stage) -> None:
    mass = UsdPhysics.MassAPI(stage.GetDefaultPrim())
    assert mass.GetMassAttr().Get() == pytest.approx(MASS_KG, rel=1e-6)
    np.testing.assert_allclose(mass.GetCenterOfMassAttr().Get(), CENTER_OF_MASS_M, rtol=1e-6)
    turn = Gf.Matrix3d(Gf.Quatd(mass.GetPrincipalAxesAttr().Get()))  # Gf multiplies rows: its transpose turns columns
    axes = np.array(turn).T
    np.testing.assert_allclose(
        axes @ np.diag(mass.GetDiagonalInertiaAttr().Get()) @ axes.T, INERTIA_KG_M2, rtol=0, atol=1e-9 * 0.6
    )


def test_usd_computes_the_same_mass_properties_from_bodies_and_colliders(stage: Usd.Stage) -> None:
    body = UsdPhysics.RigidBodyAPI(stage.GetDefaultPrim())

    def never_asked(prim: Usd.Prim) -> UsdPhysics.RigidBodyAPI.MassInformation:
        information = UsdPhysics.RigidBodyAPI.MassInformation()
        information.volume, information.inertia = 1e3, Gf.Matrix3f(1e3)
        return information

    mass, inertia, center, axes = body.ComputeMassProperties(never_asked)
    assert mass == pytest.approx(MASS_KG, rel=1e-6)
    np.testing.assert_allclose(center, CENTER_OF_MASS_M, rtol=1e-6)
    np.testing.assert_allclose(np.sort(inertia), np.linalg.eigvalsh(INERTIA_KG_M2), rtol=1e-5)
    turned = Rotation.from_quat([axes.GetReal(), *axes.GetImaginary()], scalar_first=True).as_matrix()
    np.testing.assert_allclose(turned @ np.diag(inertia) @ turned.T, INERTIA_KG_M2, rtol=0, atol=1e-8)


def test_text_of_the_stage_says_the_same_inertia(main: Path) -> None:
    text = Sdf.Layer.FindOrOpen(str(main)).ExportToString()

    def numbers(name: str) -> np.ndarray:
        (found,) = re.findall(rf"physics:{name} = \(?([^)\n]+)\)?", text)
        return np.array([float(each) for each in found.split(",")])

    w, x, y, z = numbers("principalAxes")
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    np.testing.assert_allclose(turn @ np.diag(numbers("diagonalInertia")) @ turn.T, INERTIA_KG_M2, rtol=0, atol=1e-9)
    assert numbers("mass") == pytest.approx(MASS_KG, rel=1e-6)


def test_boxes_are_those_of_the_meshes(stage: Usd.Stage) -> None:
    corners = np.concatenate(hulls())
    for purposes, scope in ((["guide"], "collision"), (["default"], "visual")):
        cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), purposes)
        if scope == "collision":  # the lines of grasps are guides, too
            stage.GetDefaultPrim().GetChild("grasps").SetActive(False)
        box = cache.ComputeWorldBound(stage.GetDefaultPrim()).ComputeAlignedRange()
        np.testing.assert_allclose([box.GetMin(), box.GetMax()], [corners.min(0), corners.max(0)], atol=1e-6)
        inside = cache.ComputeWorldBound(stage.GetDefaultPrim().GetChild(scope)).ComputeAlignedRange()
        assert box == inside
        points = np.concatenate([mesh.GetPointsAttr().Get() for mesh in meshes(stage, scope)])
        np.testing.assert_allclose([points.min(0), points.max(0)], [box.GetMin(), box.GetMax()], atol=1e-6)


def test_each_hull_is_a_convex_collider_of_the_twins_friction(stage: Usd.Stage, twin: TwinContent) -> None:
    found = meshes(stage, "collision")
    assert len(found) == len(twin.hulls) == 3
    for mesh, (vertices, faces) in zip(found, twin.hulls, strict=True):
        prim = mesh.GetPrim()
        assert prim.HasAPI(UsdPhysics.CollisionAPI) and mesh.ComputePurpose() == "guide"
        assert UsdPhysics.MeshCollisionAPI(prim).GetApproximationAttr().Get() == "convexHull"
        read = trimesh.Trimesh(mesh.GetPointsAttr().Get(), np.reshape(mesh.GetFaceVertexIndicesAttr().Get(), (-1, 3)))
        assert read.volume == pytest.approx(trimesh.Trimesh(vertices, faces).volume, rel=1e-5) and read.volume > 0
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")
        surface = UsdPhysics.MaterialAPI(material.GetPrim())
        read_back = [
            attribute.Get()
            for attribute in (
                surface.GetStaticFrictionAttr(), surface.GetDynamicFrictionAttr(), surface.GetRestitutionAttr(),
            )
        ]  # fmt: skip
        assert read_back == pytest.approx([STATIC, DYNAMIC, RESTITUTION], rel=1e-6)
        assert not surface.GetDensityAttr().HasAuthoredValue()


def test_visual_meshes_are_closed_and_keep_their_normals(stage: Usd.Stage) -> None:
    for mesh, part in zip(meshes(stage, "visual"), visual_parts(), strict=True):
        points = np.array(mesh.GetPointsAttr().Get(), float)
        faces = np.reshape(mesh.GetFaceVertexIndicesAttr().Get(), (-1, 3))
        assert len(np.unique(points, axis=0)) == len(points)
        assert trimesh.Trimesh(points, faces, process=False).is_watertight
        assert mesh.GetSubdivisionSchemeAttr().Get() == "none"
        normals = np.array(mesh.GetNormalsAttr().Get(), float)
        if mesh.GetNormalsInterpolation() == "vertex":
            normals = normals[faces.reshape(-1)]
        assert len(normals) == 3 * len(faces)
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
        np.testing.assert_allclose(normals, np.asarray(part.vertex_normals)[part.faces.reshape(-1)], atol=1e-5)


def test_creases_are_kept_where_points_are_shared(stage: Usd.Stage) -> None:
    head = meshes(stage, "visual")[0]  # a box whose corners have three normals
    assert len(head.GetPointsAttr().Get()) == 8
    assert head.GetNormalsInterpolation() == "faceVarying"
    corners = np.array(head.GetPointsAttr().Get())[np.array(head.GetFaceVertexIndicesAttr().Get())].reshape(-1, 3, 3)
    flat = trimesh.triangles.normals(corners)[0]
    np.testing.assert_allclose(
        np.reshape(head.GetNormalsAttr().Get(), (-1, 3, 3)), flat[:, None].repeat(3, 1), atol=1e-5
    )


def test_texture_is_the_file_of_the_twin_and_lies_right_way_up(stage: Usd.Stage, twin: TwinContent) -> None:
    head = meshes(stage, "visual")[0]
    material, _ = UsdShade.MaterialBindingAPI(head.GetPrim()).ComputeBoundMaterial()
    surface, _, _ = material.ComputeSurfaceSource()
    (source,) = surface.GetInput("diffuseColor").GetConnectedSources()[0]
    reader, output = UsdShade.Shader(source.source.GetPrim()), source.sourceName
    assert (output, reader.GetInput("sourceColorSpace").Get()) == ("rgb", "sRGB")
    asset = reader.GetInput("file").Get()
    assert asset.path.startswith("./textures/") and asset.resolvedPath
    files = usd.export(twin).files
    assert files[asset.path.removeprefix("./")] in twin.visual_glb and len(files) == 2
    st = UsdGeom.PrimvarsAPI(head).GetPrimvar("st")
    assert st.IsIndexed() and st.GetInterpolation() == "faceVarying"
    np.testing.assert_allclose(st.ComputeFlattened()[:3], [[0.05, 0.05], [0.95, 0.05], [0.05, 0.95]], atol=1e-6)


def test_plain_colour_is_linear(stage: Usd.Stage) -> None:
    material, _ = UsdShade.MaterialBindingAPI(meshes(stage, "visual")[1].GetPrim()).ComputeBoundMaterial()
    surface, _, _ = material.ComputeSurfaceSource()
    np.testing.assert_allclose(surface.GetInput("diffuseColor").Get(), BASE_COLOR_LINEAR, atol=1 / 255)
    assert surface.GetInput("roughness").Get() == pytest.approx(0.6)


def test_source_licence_and_intervals_travel_along(stage: Usd.Stage, twin: TwinContent) -> None:
    said = stage.GetDefaultPrim().GetCustomDataByKey("manitwin")
    assert (said["license"], said["attribution"]) == ("CC-BY-4.0", "Ada Lovelace")
    assert said["twin_id"] == twin.record.twin_id and said["source"]["sha256"] == twin.record.source.sha256
    mass = twin.physical.mass_kg
    assert said["mass_kg"] == {"value": mass.value, "low": mass.low, "high": mass.high, "source": mass.source}
    assert "CC-BY-4.0; Ada Lovelace" in stage.GetRootLayer().documentation
    assert Usd.ModelAPI(stage.GetDefaultPrim()).GetAssetVersion() == twin.record.revision


def test_images_from_elsewhere_are_kept_without_loss(twin: TwinContent) -> None:
    picture = next(part.visual.material.baseColorTexture for part in visual_parts())
    data, suffix = GlbImages(twin.visual_glb).encoded(picture)  # before the GLB made a JPEG of it
    assert suffix == "png" and data.startswith(b"\x89PNG")


def meshes(stage: Usd.Stage, scope: str) -> list[UsdGeom.Mesh]:
    return [UsdGeom.Mesh(prim) for prim in stage.GetDefaultPrim().GetChild(scope).GetChildren()]
