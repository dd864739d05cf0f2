"""The things that move in themselves as USD stages, as a converter from URDF or MJCF would write them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics
from scipy.spatial.transform import Rotation

from manitwin.assets.asset import Asset
from manitwin.assets.writers.mass_properties import principal_axes
from manitwin.geometry.articulation import ArticulatedJoint

AXES = {"X": np.array([1.0, 0, 0]), "Y": np.array([0, 1.0, 0]), "Z": np.array([0, 0, 1.0])}


def quaternion(rotation: np.ndarray) -> Gf.Quatf:
    return Gf.Quatf(*Rotation.from_matrix(rotation).as_quat(scalar_first=True).tolist())


def write_usd(
    asset: Asset,
    path: Path,
    *,
    unit_m: float = 1.0,
    unit_kg: float = 1.0,
    nested: bool = False,
    backward: bool = False,
    axis: str = "X",
    seed: int = 0,
) -> Usd.Stage:
    """Write links as bodies in frames of their own, turned at random; ``nested``: below the body that holds them.

    ``backward``: the second body of each joint is the one that holds the first, and the first link is said to be the root.
    ``axis``: of the joints' own frames.
    """
    found, rng = asset.articulation, np.random.default_rng(seed)
    assert found is not None
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, unit_m)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdPhysics.SetStageKilogramsPerUnit(stage, unit_kg)
    top = UsdGeom.Xform.Define(stage, "/thing").GetPrim()
    stage.SetDefaultPrim(top)
    frames, paths = [], []
    for place, link in enumerate(found.links):
        holder = next((joint.parent for joint in found.joints if joint.child == place), None)
        paths.append(f"{paths[holder] if nested and holder is not None else '/thing'}/{link.name}")
        frame = np.eye(4)
        frame[:3, :3] = Rotation.random(random_state=rng).as_matrix()
        frame[:3, 3] = rng.uniform(-0.3, 0.3, 3)
        frames.append(frame)
        body = UsdGeom.Xform.Define(stage, paths[-1])
        local = np.linalg.inv(frames[holder]) @ frame if nested and holder is not None else frame
        body.AddTranslateOp().Set(Gf.Vec3d(*(local[:3, 3] / unit_m).tolist()))
        body.AddOrientOp().Set(quaternion(local[:3, :3]))
        UsdPhysics.RigidBodyAPI.Apply(body.GetPrim())
        _weigh(body.GetPrim(), link.inertial, frame, unit_m, unit_kg)
        parts = [part for part, of in zip(asset.visual, found.link_of_visual, strict=True) if of == place]
        for number, part in enumerate(parts):
            mesh = UsdGeom.Mesh.Define(stage, f"{paths[-1]}/part_{number}")
            points = (np.asarray(part.vertices) - frame[:3, 3]) @ frame[:3, :3] / unit_m
            mesh.CreatePointsAttr(points.tolist())
            mesh.CreateFaceVertexCountsAttr([3] * len(part.faces))
            mesh.CreateFaceVertexIndicesAttr(np.asarray(part.faces).reshape(-1).tolist())
            UsdPhysics.CollisionAPI.Apply(mesh.GetPrim())
            UsdPhysics.MeshCollisionAPI.Apply(mesh.GetPrim()).CreateApproximationAttr("convexHull")
    UsdPhysics.ArticulationRootAPI.Apply(stage.GetPrimAtPath(paths[0]) if backward else top)
    for joint in found.joints:
        ends = (joint.child, joint.parent) if backward else (joint.parent, joint.child)
        _join(
            stage, joint, [paths[end] for end in ends], [frames[end] for end in ends], backward, axis, unit_m, unit_kg
        )
    stage.Save()
    return stage


def _weigh(prim: Usd.Prim, inertial: object, frame: np.ndarray, unit_m: float, unit_kg: float) -> None:
    turn = frame[:3, :3]
    moments, axes = principal_axes(turn.T @ np.asarray(inertial.inertia_kg_m2) @ turn)
    mass = UsdPhysics.MassAPI.Apply(prim)
    mass.CreateMassAttr(inertial.mass_kg / unit_kg)
    center = (np.asarray(inertial.center_of_mass_m) - frame[:3, 3]) @ turn / unit_m
    mass.CreateCenterOfMassAttr(Gf.Vec3f(*center.tolist()))
    mass.CreateDiagonalInertiaAttr(Gf.Vec3f(*(moments / unit_kg / unit_m**2).tolist()))
    mass.CreatePrincipalAxesAttr(Gf.Quatf(*axes.tolist()))


def _join(
    stage: Usd.Stage,
    joint: ArticulatedJoint,
    paths: list[str],
    frames: list[np.ndarray],
    backward: bool,
    axis: str,
    unit_m: float,
    unit_kg: float,
) -> None:
    """Write a joint whose frames meet at position 0; the links stand where it is at ``stands_at``."""
    slides = joint.kind == "prismatic"
    made = (UsdPhysics.PrismaticJoint if slides else UsdPhysics.RevoluteJoint).Define(
        stage, f"/thing/joints/{joint.name}"
    )
    made.CreateBody0Rel().SetTargets([paths[0]])
    made.CreateBody1Rel().SetTargets([paths[1]])
    made.CreateAxisAttr(axis)
    first = np.eye(4)
    along = -joint.axis if backward else joint.axis
    first[:3, :3] = Rotation.align_vectors(along[None], AXES[axis][None])[0].as_matrix()
    first[:3, 3] = joint.origin_m
    way = np.eye(4)
    if slides:
        way[:3, 3] = joint.stands_at * AXES[axis]
    else:
        way[:3, :3] = Rotation.from_rotvec(joint.stands_at * AXES[axis]).as_matrix()
    for end, (frame, placed) in enumerate(zip(frames, (first, first @ way), strict=True)):
        local = np.linalg.inv(frame) @ placed
        getattr(made, f"CreateLocalPos{end}Attr")(Gf.Vec3f(*(local[:3, 3] / unit_m).tolist()))
        getattr(made, f"CreateLocalRot{end}Attr")(quaternion(local[:3, :3]))
    unit = unit_m if slides else math.radians(1)
    if joint.lower is not None:
        made.CreateLowerLimitAttr(joint.lower / unit)
        made.CreateUpperLimitAttr(joint.upper / unit)
    force = unit_kg * (unit_m if slides else unit_m**2)
    drive = UsdPhysics.DriveAPI.Apply(made.GetPrim(), "linear" if slides else "angular")
    drive.CreateDampingAttr(joint.damping / force * unit)
    if joint.effort is not None:
        drive.CreateMaxForceAttr(joint.effort / force)


def motions_of(stage: Usd.Stage, positions: dict[str, float]) -> dict[Sdf.Path, np.ndarray]:
    """Return how bodies move ``(4, 4)`` in metres from where a stage has them, its joints at positions in rad and m.

    Joints, bodies and frames are as UsdPhysics reads them; the second body of each is put where its frame meets the first one's.
    """
    parse = getattr(UsdPhysics, "UsdPhysicsLoadStageFromPrimRange", None) or UsdPhysics.LoadUsdPhysicsFromRange
    parsed, unit_m = parse(stage, ["/"]), UsdGeom.GetStageMetersPerUnit(stage)
    revolute, prismatic = UsdPhysics.ObjectType.RevoluteJoint, UsdPhysics.ObjectType.PrismaticJoint
    found: dict[Sdf.Path, tuple[Sdf.Path, np.ndarray]] = {}
    scale = np.diag([unit_m] * 3 + [1.0])
    for kind in (revolute, prismatic):
        for path, each in zip(*parsed.get(kind, ([], [])), strict=True):
            step, axis = np.eye(4), AXES[each.axis.name[-1]]
            if kind == prismatic:
                step[:3, 3] = positions[path.name] / unit_m * axis
            else:
                turn = Gf.Rotation(Gf.Vec3d(*axis.tolist()), math.degrees(positions[path.name]))
                step[:3, :3] = np.array(Gf.Matrix3d(turn)).T
            first = _pose(stage, each.body0) @ _frame(each.localPose0Position, each.localPose0Orientation)
            second = _pose(stage, each.body1) @ _frame(each.localPose1Position, each.localPose1Orientation)
            alone = scale @ first @ step @ np.linalg.inv(second) @ np.linalg.inv(scale)
            found[each.body1] = (each.body0, alone)
    return {body: _chained(found, body) for body in found}


def _chained(found: dict[Sdf.Path, tuple[Sdf.Path, np.ndarray]], body: Sdf.Path) -> np.ndarray:
    if body not in found:
        return np.eye(4)
    holder, alone = found[body]
    return _chained(found, holder) @ alone


def _pose(stage: Usd.Stage, path: Sdf.Path) -> np.ndarray:
    return np.array(UsdGeom.Xformable(stage.GetPrimAtPath(path)).ComputeLocalToWorldTransform(0)).T


def _frame(position: Gf.Vec3f, turn: Gf.Quatf) -> np.ndarray:
    found = np.eye(4)
    found[:3, :3] = np.array(Gf.Matrix3d(Gf.Quatd(turn))).T
    found[:3, 3] = position
    return found
