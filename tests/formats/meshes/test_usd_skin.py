"""Meshes on skeletons, in the pose that a stage holds: two joints, of which the second bends by a right angle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdSkel, UsdUtils, Vt

from manitwin.assets.readers.usd import read_here
from manitwin.errors import AssetError, InputError
from manitwin.formats.meshes.read import read_mesh

UPRIGHT = [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1), (1, 0, 2), (0, 0, 2)]
"""A strip of two squares along Z; the joint between them is at (0, 0, 1)."""
POSED = "it is bound to a skeleton; it was taken in the first pose that the file holds"


def _bent() -> Gf.Matrix4d:
    matrix = Gf.Matrix4d(1).SetRotate(Gf.Rotation(Gf.Vec3d(0, 1, 0), 90))
    return matrix.SetTranslateOnly(Gf.Vec3d(0, 0, 1))


def _strip(folder: Path, *, animated: bool = False, weights: int = 6) -> Path:
    stage = Usd.Stage.CreateNew(str(folder / "strip.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    root = UsdSkel.Root.Define(stage, "/thing")
    stage.SetDefaultPrim(root.GetPrim())
    skeleton = UsdSkel.Skeleton.Define(stage, "/thing/skeleton")
    UsdGeom.XformCommonAPI(skeleton).SetTranslate((5, 0, 0))
    skeleton.CreateJointsAttr(["low", "low/high"])
    straight = [Gf.Matrix4d(1), Gf.Matrix4d(1).SetTranslate(Gf.Vec3d(0, 0, 1))]
    skeleton.CreateBindTransformsAttr(straight)
    skeleton.CreateRestTransformsAttr(straight if animated else [straight[0], _bent()])
    if animated:
        motion = UsdSkel.Animation.Define(stage, "/thing/skeleton/motion")
        motion.CreateJointsAttr(["low", "low/high"])
        for frame, last in ((1, _bent()), (9, straight[1])):
            motion.SetTransforms(Vt.Matrix4dArray([straight[0], last]), Usd.TimeCode(frame))
        UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([motion.GetPath()])
    mesh = UsdGeom.Mesh.Define(stage, "/thing/strip")
    mesh.CreatePointsAttr([Gf.Vec3f(*point) for point in UPRIGHT])
    mesh.CreateFaceVertexCountsAttr([4, 4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3, 3, 2, 4, 5])
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateJointIndicesPrimvar(False, 1).Set(Vt.IntArray([0, 0, 0, 0, 1, 1][:weights]))
    binding.CreateJointWeightsPrimvar(False, 1).Set(Vt.FloatArray([1.0] * weights))
    stage.Save()
    return folder / "strip.usda"


@pytest.mark.parametrize("animated", [False, True])
def test_a_bound_mesh_is_read_in_the_pose_of_its_skeleton(tmp_path: Path, animated: bool) -> None:
    """Turned about Y at (0, 0, 1), the upper corners (x, 0, 2) come to (1, 0, 1 - x); all of it by 5 with its skeleton."""
    asset = read_here(_strip(tmp_path, animated=animated))
    (part,) = asset.visual
    expected = {(5, 0, 0), (6, 0, 0), (6, 0, 1), (5, 0, 1)}  # the upper ones come to the lower square's right side
    assert {tuple(np.round(row).astype(int)) for row in part.vertices} == expected
    assert POSED in asset.remarks


def test_a_bound_mesh_of_a_package_is_read_too(tmp_path: Path) -> None:
    assert UsdUtils.CreateNewUsdzPackage(str(_strip(tmp_path)), str(tmp_path / "strip.usdz"))
    mesh = read_mesh(tmp_path / "strip.usdz")
    assert POSED in mesh.findings
    np.testing.assert_allclose(mesh.parts[0].bounds, [[5, 0, 0], [6, 0, 1]], atol=1e-6)


def test_a_skeleton_that_does_not_fit_its_mesh_is_refused(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="the skeleton that 'strip' is bound to does not fit it; apply the pose"):
        read_here(_strip(tmp_path, weights=3))
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "strip.usda"), str(tmp_path / "strip.usdz"))
    with pytest.raises(InputError, match="does not fit it"):
        read_mesh(tmp_path / "strip.usdz")
