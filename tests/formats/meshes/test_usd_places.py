"""What point instancers repeat, where they repeat it, and those that ask for too much or fit nothing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdUtils
from scipy.spatial.transform import Rotation

from manitwin.assets.asset import Asset
from manitwin.assets.readers.usd import read_here
from manitwin.errors import AssetError
from manitwin.formats.meshes.read import read_mesh


def instancer(
    stage: Usd.Stage, path: str, prototypes: list[str], which: list[int], at: list[tuple[float, float, float]]
) -> UsdGeom.PointInstancer:
    made = UsdGeom.PointInstancer.Define(stage, path)
    made.CreatePrototypesRel().SetTargets(prototypes)
    made.CreateProtoIndicesAttr(which)
    made.CreatePositionsAttr(at)
    return made


def cube(stage: Usd.Stage, path: str, size: float = 1.0) -> UsdGeom.Cube:
    made = UsdGeom.Cube.Define(stage, path)
    made.CreateSizeAttr(size)
    return made


def made(folder: Path, make: Callable[[Usd.Stage], object]) -> Asset:
    stage = Usd.Stage.CreateNew(str(folder / "thing.usda"))
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/thing").GetPrim())
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    make(stage)
    stage.Save()
    return read_here(folder / "thing.usda")


def centers(asset: Asset) -> list[list[float]]:
    return [part.bounds.mean(0).round(6).tolist() for part in asset.visual]


def test_prototypes_are_read_at_each_place_and_nowhere_else(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        UsdGeom.Xform(stage.GetDefaultPrim()).AddTranslateOp().Set((0, 0, 10))
        UsdGeom.Xform.Define(stage, "/thing/many/kinds/a").AddTranslateOp().Set((0, 0, 5))
        cube(stage, "/thing/many/kinds/a/shape").AddTranslateOp().Set((0, 1, 0))
        stage.CreateClassPrim("/kinds")
        cube(stage, "/kinds/b", 2.0)
        placed = instancer(
            stage, "/thing/many", ["/thing/many/kinds/a", "/kinds/b"], [0, 1, 0, 0], [(x, 0, 0) for x in range(4)]
        )
        placed.CreateInvisibleIdsAttr([3])

    asset = made(tmp_path, make)
    assert centers(asset) == [[0, 1, 15], [1, 0, 10], [2, 1, 15]]
    assert [float(np.ptp(part.vertices[:, 0])) for part in asset.visual] == [1, 2, 1]


def test_turns_and_scales_count_from_the_instancer(tmp_path: Path) -> None:
    turn = Rotation.from_euler("xyz", [10, 20, 30], degrees=True)

    def make(stage: Usd.Stage) -> None:
        cube(stage, "/thing/many/kind").AddTranslateOp().Set((1, 0, 0))
        placed = instancer(stage, "/thing/many", ["/thing/many/kind"], [0], [(0, 0, 3)])
        placed.CreateOrientationsAttr([Gf.Quath(*turn.as_quat(scalar_first=True).tolist())])
        placed.CreateScalesAttr([(1, 2, 4)])
        placed.AddScaleOp().Set((2, 2, 2))

    (part,) = made(tmp_path, make).visual
    local = (part.vertices / 2 - [0, 0, 3]) @ turn.as_matrix() / [1, 2, 4]
    np.testing.assert_allclose(np.sort(np.unique(local.round(2), axis=0)[:, 0])[[0, -1]], [0.5, 1.5], atol=0.01)
    np.testing.assert_allclose(np.abs(local[:, 1:]).max(0), [0.5, 0.5], atol=5e-3)  # halves have three digits


def test_instances_collide_and_weigh_each(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        prim = cube(stage, "/thing/many/kind").GetPrim()
        UsdPhysics.CollisionAPI.Apply(prim)
        UsdPhysics.MassAPI.Apply(prim).CreateMassAttr(0.25)
        UsdPhysics.MassAPI(prim).CreateCenterOfMassAttr((0, 0, 0))
        instancer(stage, "/thing/many", ["/thing/many/kind"], [0, 0], [(0, 0, 0), (3, 0, 0)])

    asset = made(tmp_path, make)
    assert len(asset.collision) == 2 and asset.inertial.mass_kg == 0.5
    np.testing.assert_allclose(asset.inertial.center_of_mass_m, [1.5, 0, 0])


def test_instancers_of_instancers_are_placed_too(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        cube(stage, "/thing/rows/row/one")
        instancer(stage, "/thing/rows/row", ["/thing/rows/row/one"], [0, 0], [(0, 0, 0), (2, 0, 0)])
        instancer(stage, "/thing/rows", ["/thing/rows/row"], [0, 0], [(0, 0, 0), (0, 5, 0)])

    assert centers(made(tmp_path, make)) == [[0, 0, 0], [2, 0, 0], [0, 5, 0], [2, 5, 0]]


def test_a_hidden_instancer_shows_nothing(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        cube(stage, "/thing/seen")
        cube(stage, "/thing/many/kind")
        instancer(stage, "/thing/many", ["/thing/many/kind"], [0], [(9, 0, 0)]).MakeInvisible()

    assert centers(made(tmp_path, make)) == [[0, 0, 0]]


@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (lambda i: i.CreateProtoIndicesAttr([0] * 5000), "repeat more than 4096 instances"),
        (lambda i: i.CreateProtoIndicesAttr([0, 7]), "has 1 prototypes and names others"),
        (lambda i: i.CreateProtoIndicesAttr([-1, 0]), "has 1 prototypes and names others"),
        (lambda i: i.CreatePositionsAttr([(0, 0, 0)] * 3), "has 2 instances and not as many places"),
        (lambda i: i.CreatePositionsAttr([(float("nan"), 0, 0)] * 2), "the transform of /thing/many/kind is"),
        (lambda i: i.CreatePrototypesRel().SetTargets(["/thing"]), "repeats instancers more than 4 deep"),
        (lambda i: i.CreatePrototypesRel().SetTargets([]), "has 0 prototypes and names others"),
    ],
)  # fmt: skip
def test_instancers_that_fit_nothing_are_errors_in_one_line(
    tmp_path: Path, spoil: Callable[[UsdGeom.PointInstancer], object], why: str
) -> None:
    def make(stage: Usd.Stage) -> None:
        cube(stage, "/thing/many/kind")
        spoil(instancer(stage, "/thing/many", ["/thing/many/kind"], [0, 0], [(0, 0, 0), (2, 0, 0)]))

    with pytest.raises(AssetError) as raised:
        made(tmp_path, make)
    assert "\n" not in str(raised.value) and why in str(raised.value)


def test_instances_of_instances_are_counted_together(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        cube(stage, "/thing/rows/row/one")
        many = [(float(x), 0, 0) for x in range(100)]
        instancer(stage, "/thing/rows/row", ["/thing/rows/row/one"], [0] * 100, many)
        instancer(stage, "/thing/rows", ["/thing/rows/row"], [0] * 100, many)

    with pytest.raises(AssetError, match="more than 4096 instances"):
        made(tmp_path, make)


def test_a_prototype_that_is_not_there_is_left_out_and_said(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        cube(stage, "/thing/many/kind")
        instancer(stage, "/thing/many", ["/thing/many/kind", "/gone"], [0, 1], [(0, 0, 0), (2, 0, 0)])

    asset = made(tmp_path, make)
    assert len(asset.visual) == 1 and any("a prototype of 'many' is not there" in remark for remark in asset.remarks)


def test_a_usdz_mesh_has_all_instances(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "thing.usdc"))
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    UsdGeom.SetStageUpAxis(stage, "Z")
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/thing").GetPrim())
    mesh = UsdGeom.Mesh.Define(stage, "/thing/many/kind")
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    mesh.CreateFaceVertexCountsAttr([3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
    instancer(stage, "/thing/many", ["/thing/many/kind"], [0, 0], [(0, 0, 0), (0, 0, 2)])
    stage.Save()
    UsdUtils.CreateNewUsdzPackage(str(tmp_path / "thing.usdc"), str(tmp_path / "thing.usdz"))
    read = read_mesh(tmp_path / "thing.usdz")
    assert len(read.parts) == 2 and not any("PointInstancer" in each for each in read.findings)
