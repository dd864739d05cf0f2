"""Stages as others write them: made here by USD's own classes, with numbers known in advance."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade
from scipy.spatial.transform import Rotation

from manitwin.assets.asset import Asset
from manitwin.assets.readers.usd import read, read_here
from manitwin.errors import AssetError


def box_mesh(stage: Usd.Stage, path: str, extents: tuple[float, float, float]) -> UsdGeom.Mesh:
    """A box of quadrilaterals about its origin."""
    x, y, z = (side / 2 for side in extents)
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr([(a, b, c) for a in (-x, x) for b in (-y, y) for c in (-z, z)])
    mesh.CreateFaceVertexCountsAttr([4] * 6)
    mesh.CreateFaceVertexIndicesAttr([0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3])
    return mesh


def collider(mesh: UsdGeom.Gprim, approximation: str | None = None) -> UsdGeom.Gprim:
    UsdPhysics.CollisionAPI.Apply(mesh.GetPrim())
    if approximation is not None:
        UsdPhysics.MeshCollisionAPI.Apply(mesh.GetPrim()).CreateApproximationAttr(approximation)
    return mesh


def stage_in(folder: Path, name: str = "thing.usda") -> Usd.Stage:
    stage = Usd.Stage.CreateNew(str(folder / name))
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/thing").GetPrim())
    return stage


def made(folder: Path, make: Callable[[Usd.Stage], object], name: str = "thing.usda") -> Asset:
    stage = stage_in(folder, name)
    make(stage)
    stage.Save()
    return read_here(folder / name)


def test_centimetres_grams_scales_and_turns_become_metres_and_kilograms(tmp_path: Path) -> None:
    """A body of 3 x 5 x 7 units of 2 cm, its inertia about turned axes, itself turned and moved."""
    turn_body, turn_axes = Rotation.from_euler("xyz", [20, 30, 40], degrees=True), Rotation.from_euler("z", 0.5)

    def make(stage: Usd.Stage) -> None:
        UsdGeom.SetStageMetersPerUnit(stage, 0.02)
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
        UsdPhysics.SetStageKilogramsPerUnit(stage, 0.001)
        body = UsdGeom.Xform(stage.GetDefaultPrim())
        body.AddTranslateOp().Set((1, 2, 3))
        body.AddOrientOp().Set(Gf.Quatf(*turn_body.as_quat(scalar_first=True).tolist()))
        UsdPhysics.RigidBodyAPI.Apply(body.GetPrim())
        mass = UsdPhysics.MassAPI.Apply(body.GetPrim())
        mass.CreateMassAttr(250.0)
        mass.CreateCenterOfMassAttr((0.5, 0, 0))
        mass.CreateDiagonalInertiaAttr((100, 200, 250))
        mass.CreatePrincipalAxesAttr(Gf.Quatf(*turn_axes.as_quat(scalar_first=True).tolist()))
        hull = collider(box_mesh(stage, "/thing/hull", (1, 1, 1)), "convexHull")
        hull.AddScaleOp().Set((3, 5, 7))

    asset = made(tmp_path, make)
    assert (asset.up, asset.unit_m, asset.name) == ("y", pytest.approx(0.02), "thing")
    turn = turn_body.as_matrix()
    assert asset.inertial.mass_kg == pytest.approx(0.25)
    assert asset.inertial.center_of_mass_m is not None and asset.inertial.inertia_kg_m2 is not None
    np.testing.assert_allclose(
        asset.inertial.center_of_mass_m, 0.02 * (np.array([1, 2, 3]) + turn @ [0.5, 0, 0]), rtol=1e-6
    )
    axes = turn @ turn_axes.as_matrix()
    expected = axes @ np.diag([100, 200, 250]) @ axes.T * 0.001 * 0.02**2
    np.testing.assert_allclose(asset.inertial.inertia_kg_m2, expected, rtol=0, atol=1e-6 * expected.max())
    for mesh in (*asset.visual, trimesh.Trimesh(asset.collision[0].vertices, asset.collision[0].faces)):
        assert mesh.volume == pytest.approx(3 * 5 * 7 * 0.02**3, rel=1e-5)
        local = (mesh.vertices / 0.02 - [1, 2, 3]) @ turn
        np.testing.assert_allclose(np.abs(local).max(0), [1.5, 2.5, 3.5], rtol=1e-5)


@pytest.mark.parametrize(
    ("approximation", "convex", "volume"),
    [
        (None, False, 8), ("none", False, 8), ("convexHull", True, 8), ("convexDecomposition", False, 8),
        ("boundingCube", True, 8), ("boundingSphere", True, 4 / 3 * np.pi * 3**1.5),
    ],
)  # fmt: skip
def test_approximation_says_what_is_convex(tmp_path: Path, approximation: str, convex: bool, volume: float) -> None:
    def make(stage: Usd.Stage) -> None:
        UsdGeom.SetStageMetersPerUnit(stage, 1)
        collider(box_mesh(stage, "/thing/hull", (2, 2, 2)), approximation)

    (shape,) = made(tmp_path, make).collision
    assert shape.convex is convex
    assert trimesh.Trimesh(shape.vertices, shape.faces).volume == pytest.approx(volume, rel=0.02)


@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
def test_primitives_are_meshes_along_their_axis(tmp_path: Path, axis: str) -> None:
    def make(stage: Usd.Stage) -> None:
        UsdGeom.SetStageMetersPerUnit(stage, 1)
        for kind in (UsdGeom.Cylinder, UsdGeom.Capsule, UsdGeom.Cone):
            shape = kind.Define(stage, f"/thing/{kind.__name__}")
            shape.CreateRadiusAttr(0.5)
            shape.CreateHeightAttr(2.0)
            shape.CreateAxisAttr(axis)
            collider(shape)
        collider(UsdGeom.Sphere.Define(stage, "/thing/Sphere")).CreateRadiusAttr(0.5)
        collider(UsdGeom.Cube.Define(stage, "/thing/Cube")).CreateSizeAttr(3)

    asset = made(tmp_path, make)
    shapes = {shape.name: trimesh.Trimesh(shape.vertices, shape.faces) for shape in asset.collision}
    along = "XYZ".index(axis)
    for name, length, volume in (
        ("Cylinder", 2, np.pi / 2), ("Capsule", 3, np.pi / 2 + np.pi / 6), ("Cone", 2, np.pi / 6),
    ):  # fmt: skip
        assert shapes[name].extents[along] == pytest.approx(length, rel=1e-3)
        assert shapes[name].volume == pytest.approx(volume, rel=0.02)
        np.testing.assert_allclose(shapes[name].bounds.sum(0), 0, atol=1e-9)
    heaviest_end = shapes["Cone"].center_mass[along]
    assert heaviest_end == pytest.approx(-0.5, abs=1e-3)  # the tip is on the positive side (UsdGeomCone)
    assert shapes["Sphere"].extents == pytest.approx(1, rel=0.01) and shapes["Cube"].volume == pytest.approx(27)
    assert all(shape.convex for shape in asset.collision) and len(asset.visual) == 5


def test_what_is_hidden_is_not_seen_and_what_guides_collides(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        UsdGeom.SetStageMetersPerUnit(stage, 1)
        box_mesh(stage, "/thing/seen", (1, 1, 1))
        UsdGeom.Imageable(box_mesh(stage, "/thing/hidden", (1, 1, 1))).MakeInvisible()
        guides = UsdGeom.Scope.Define(stage, "/thing/guides")
        guides.CreatePurposeAttr("guide")
        box_mesh(stage, "/thing/guides/bare", (1, 1, 1))
        collider(box_mesh(stage, "/thing/guides/off", (1, 1, 1)))
        UsdPhysics.CollisionAPI(stage.GetPrimAtPath("/thing/guides/off")).CreateCollisionEnabledAttr(False)
        UsdPhysics.CollisionAPI.Apply(UsdGeom.Xform.Define(stage, "/thing/group").GetPrim())
        box_mesh(stage, "/thing/group/below", (1, 1, 1))

    asset = made(tmp_path, make)
    assert [part.metadata["name"] for part in asset.visual] == ["seen", "below"]
    assert [shape.name for shape in asset.collision] == ["bare", "below"]
    assert any("not on the shapes below" in remark for remark in asset.remarks)


def test_masses_of_parts_are_joined_as_one_body(tmp_path: Path) -> None:
    """Two point-like masses of 1 and 3 kg, 4 m apart: the parallel axis theorem by hand."""

    def make(stage: Usd.Stage) -> None:
        UsdGeom.SetStageMetersPerUnit(stage, 1)
        for name, kilograms, x in (("light", 1.0, 0.0), ("heavy", 3.0, 4.0)):
            mesh = box_mesh(stage, f"/thing/{name}", (1, 1, 1))
            mesh.AddTranslateOp().Set((x, 0, 0))
            mass = UsdPhysics.MassAPI.Apply(mesh.GetPrim())
            mass.CreateMassAttr(kilograms)
            mass.CreateCenterOfMassAttr((0, 0, 0))
            mass.CreateDiagonalInertiaAttr((0.1, 0.1, 0.1))

    inertial = made(tmp_path, make).inertial
    assert inertial.mass_kg == 4 and inertial.inertia_kg_m2 is not None
    np.testing.assert_allclose(inertial.center_of_mass_m, [3, 0, 0])
    np.testing.assert_allclose(inertial.inertia_kg_m2, np.diag([0.2, 12.2, 12.2]), atol=1e-6)


def test_mass_of_the_body_stands_for_its_parts(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        UsdPhysics.MassAPI.Apply(stage.GetDefaultPrim()).CreateMassAttr(2.0)
        mesh = box_mesh(stage, "/thing/part", (1, 1, 1))
        UsdPhysics.MassAPI.Apply(mesh.GetPrim()).CreateMassAttr(7.0)

    asset = made(tmp_path, make)
    assert asset.inertial.mass_kg == 2
    assert asset.inertial.center_of_mass_m is None and asset.inertial.inertia_kg_m2 is None
    assert asset.unit_m is None and any("declares no metersPerUnit" in remark for remark in asset.remarks)
    assert np.ptp(asset.visual[0].vertices[:, 0]) == pytest.approx(0.01)  # centimetres by USD's rule


def test_a_density_gives_the_mass_of_the_hull_and_a_mass_of_zero_is_kept(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        UsdGeom.SetStageMetersPerUnit(stage, 1)
        mesh = collider(box_mesh(stage, "/thing/part", (1, 1, 1)))
        mass = UsdPhysics.MassAPI.Apply(mesh.GetPrim())
        mass.CreateDensityAttr(1000.0)

    asset = made(tmp_path, make)
    assert asset.inertial.mass_kg == pytest.approx(1000) and asset.inertial.computed
    assert np.allclose(asset.inertial.inertia_kg_m2, np.eye(3) * 1000 / 6)
    assert any("1000 kg/m3 in place of a mass" in remark for remark in asset.remarks)

    def zero(stage: Usd.Stage) -> None:
        box_mesh(stage, "/thing/part", (1, 1, 1))
        UsdPhysics.MassAPI.Apply(stage.GetDefaultPrim()).CreateMassAttr(0.0)

    assert made(tmp_path, zero, "zero.usda").inertial.mass_kg == 0


def test_a_density_may_be_that_of_the_bound_physics_material(tmp_path: Path) -> None:
    """Grams per cubic centimetre of a stage in centimetres and grams."""

    def make(stage: Usd.Stage, bind: bool = True) -> None:
        UsdGeom.SetStageMetersPerUnit(stage, 0.01)
        UsdPhysics.SetStageKilogramsPerUnit(stage, 0.001)
        mesh = collider(box_mesh(stage, "/thing/part", (10, 10, 10)))
        material = UsdShade.Material.Define(stage, "/thing/wood")
        UsdPhysics.MaterialAPI.Apply(material.GetPrim()).CreateDensityAttr(0.7)
        if bind:
            UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material, materialPurpose="physics")

    assert made(tmp_path, make).inertial.mass_kg == pytest.approx(0.7)
    assert made(tmp_path, lambda stage: make(stage, bind=False), "bare.usda").inertial.mass_kg is None


def test_layers_above_the_folder_are_read_below_the_root_alone(tmp_path: Path) -> None:
    (tmp_path / "kit" / "asset").mkdir(parents=True)
    part = Usd.Stage.CreateNew(str(tmp_path / "kit" / "part.usda"))
    part.SetDefaultPrim(box_mesh(part, "/box", (1, 1, 1)).GetPrim())
    part.Save()
    stage = stage_in(tmp_path / "kit" / "asset")
    stage.DefinePrim("/thing/box").GetReferences().AddReference("../part.usda")
    stage.Save()
    file = tmp_path / "kit" / "asset" / "thing.usda"
    asset = read(file, tmp_path / "kit")
    assert len(asset.visual) == 1 and {each.name for each in asset.files} == {"thing.usda", "part.usda"}
    assert "files were read from above its own folder, below the root 'kit'" in asset.remarks
    with pytest.raises(AssetError, match="no prim of it has a shape"):
        read_here(file)
    (tmp_path / "kit" / "part.usda").unlink()
    with pytest.raises(AssetError, match=r"layers that it names are not there: \.\./part\.usda"):
        read_here(file, tmp_path / "kit")


def test_friction_is_that_of_the_bound_physics_material_only(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        mesh = collider(box_mesh(stage, "/thing/part", (1, 1, 1)))
        for name, friction in (("bound", 0.6), ("loose", 0.9)):
            material = UsdShade.Material.Define(stage, f"/thing/{name}")
            UsdPhysics.MaterialAPI.Apply(material.GetPrim()).CreateStaticFrictionAttr(friction)
        bound = UsdShade.Material(stage.GetPrimAtPath("/thing/bound"))
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(bound, materialPurpose="physics")

    contact = made(tmp_path, make).contact
    assert contact.friction_static == 0.6
    assert contact.friction_dynamic is None and contact.restitution is None  # nobody wrote them


def test_licence_is_read_from_custom_data_or_documentation(tmp_path: Path) -> None:
    def custom(stage: Usd.Stage) -> None:
        box_mesh(stage, "/thing/part", (1, 1, 1))
        stage.GetRootLayer().customLayerData = {"license": "CC0-1.0", "author": "Ada", "made": 3}

    asset = made(tmp_path, custom)
    assert (asset.license, asset.attribution) == ("CC0-1.0", "Ada")

    def documented(stage: Usd.Stage) -> None:
        box_mesh(stage, "/thing/part", (1, 1, 1))
        stage.GetRootLayer().documentation = "A box\nLicense: CC-BY-4.0\nAuthor: Grace"

    asset = made(tmp_path, documented, "documented.usda")
    assert (asset.license, asset.attribution) == ("CC-BY-4.0", "Grace")


def test_layers_of_the_folder_are_composed_and_textures_found_beside_them(tmp_path: Path) -> None:
    """A root that references a layer in a subfolder, whose texture lies there, over a sublayer with the mass."""
    (tmp_path / "parts").mkdir()
    Image.new("RGB", (8, 4), (10, 200, 30)).save(tmp_path / "parts" / "skin.png")
    part = Usd.Stage.CreateNew(str(tmp_path / "parts" / "part.usdc"))
    part.SetDefaultPrim(UsdGeom.Xform.Define(part, "/part").GetPrim())
    mesh = box_mesh(part, "/part/shape", (1, 1, 1))
    st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
    st.Set([(0, 0), (1, 0), (1, 1), (0, 1)] * 6)
    material = UsdShade.Material.Define(part, "/part/skin")
    surface = UsdShade.Shader.Define(part, "/part/skin/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    reader = UsdShade.Shader.Define(part, "/part/skin/texture")
    reader.CreateIdAttr("UsdUVTexture")
    reader.CreateInput("file", Sdf.ValueTypeNames.Asset).Set("./skin.png")
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(reader.ConnectableAPI(), "rgb")
    material.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    part.Save()
    physics = Usd.Stage.CreateNew(str(tmp_path / "physics.usda"))
    UsdPhysics.MassAPI.Apply(physics.OverridePrim("/thing")).CreateMassAttr(0.5)
    physics.Save()
    stage = stage_in(tmp_path)
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    stage.GetPrimAtPath("/thing").GetReferences().AddReference("./parts/part.usdc")
    stage.GetRootLayer().subLayerPaths.append("./physics.usda")
    stage.GetRootLayer().subLayerPaths.append("./gone.usda")
    stage.Save()

    asset = read(tmp_path / "thing.usda")
    assert asset.inertial.mass_kg == 0.5
    assert asset.visual[0].visual.material.baseColorTexture.getpixel((0, 0)) == (10, 200, 30)
    named = [file.relative_to(tmp_path.resolve()).as_posix() for file in asset.files]
    assert named == ["parts/part.usdc", "parts/skin.png", "physics.usda", "thing.usda"]
    assert asset.missing_files == ("./gone.usda",)


def test_mirrored_instances_are_expanded_the_right_way_out(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        UsdGeom.SetStageMetersPerUnit(stage, 1)
        stage.CreateClassPrim("/master")
        box_mesh(stage, "/master/shape", (1, 2, 3))
        for name, scale in (("a", (1, 1, 1)), ("b", (-1, 1, 1))):
            prim = UsdGeom.Xform.Define(stage, f"/thing/{name}")
            prim.GetPrim().GetReferences().AddInternalReference("/master")
            prim.GetPrim().SetInstanceable(True)
            prim.AddScaleOp().Set(scale)

    asset = made(tmp_path, make)
    assert [part.volume for part in asset.visual] == pytest.approx([6, 6])


def test_folder_without_a_stage_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="no asset of a known format"):
        read(tmp_path)


@pytest.mark.parametrize(("scheme", "said"), [("catmullClark", True), ("loop", True), ("none", False), (None, False)])
def test_subdivision_surfaces_are_told_to_be_their_control_meshes(
    tmp_path: Path, scheme: str | None, said: bool
) -> None:
    def make(stage: Usd.Stage) -> None:
        mesh = box_mesh(stage, "/thing/part", (1, 1, 1))
        if scheme is not None:
            mesh.CreateSubdivisionSchemeAttr(scheme)

    assert any("subdivision surfaces" in each for each in made(tmp_path, make).remarks) == said
