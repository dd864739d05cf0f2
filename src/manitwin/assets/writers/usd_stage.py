"""A twin as one USD stage in memory: metres, Z up, one rigid body, every number written out."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt

from manitwin.assets.writers.exporter import TwinContent
from manitwin.assets.writers.mass_properties import principal_axes
from manitwin.assets.writers.simready import define_grasp_lines, describe_asset, label_prims, set_display_color
from manitwin.assets.writers.usd_materials import GlbImages, PreviewMaterials, unique_name
from manitwin.formats.meshes.textures import material_of, uv_of
from manitwin.twin.record_values import Estimate

RUNTIME_COLLIDERS = ("MjcCollisionAPI", "NewtonCollisionAPI", "NewtonMeshCollisionAPI")
"""Applied schemas by which MuJoCo's and Newton's importers know a collider; all their values are the defaults."""

CANNOT_SAY = (
    "USD has no rule for how the frictions of two bodies are combined: the simulator's own is used "
    "(PhysX: average, unless physxMaterial:frictionCombineMode says otherwise)",
    "USD keeps single precision: vertices, mass and inertia are rounded to 7 digits",
    "points and placements have no place in UsdPhysics: they stay in twin.json; the intervals and sources of mass and friction "
    "are in the default prim's customData, under 'manitwin'",
    "of the grasps that held the best and most different, 32 at most, are lines between the fingertips below 'grasps', without "
    "approach and depth: all are in grasps.parquet",
)


def build_stage(twin: TwinContent) -> tuple[Usd.Stage, dict[str, bytes]]:
    """Return the stage, and the texture files that it names by path relative to itself.

    The default prim is the rigid body: an Xform of kind component with ``visual``, ``collision`` and ``materials`` below
    it. There is no physics scene in it: that is for the scene that references it.
    Source: USD Physics schema; AOUSD guidelines for asset structure.
    """
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    path = Sdf.Path.absoluteRootPath.AppendChild(twin.name)
    body = UsdGeom.Xform.Define(stage, path)
    root = body.GetPrim()
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind(Kind.Tokens.component)
    _describe(stage, root, twin)
    body.AddTranslateOp().Set(Gf.Vec3d(0, 0, 0))
    body.AddOrientOp().Set(Gf.Quatf(1, 0, 0, 0))
    body.AddScaleOp().Set(Gf.Vec3f(1, 1, 1))
    define_rigid_body(root, twin)
    visual = UsdGeom.Scope.Define(stage, path.AppendChild("visual"))
    UsdGeom.Scope.Define(stage, path.AppendChild("materials"))
    materials = PreviewMaterials(stage, path.AppendPath("materials"), GlbImages(twin.visual_glb))
    for part in twin.visual:
        _define_visual(stage, path.AppendChild("visual"), part, materials)
    friction = define_physics_material(stage, path.AppendPath("materials/physics"), twin)
    define_hulls(stage, path.AppendChild("collision"), twin, friction)
    define_grasp_lines(stage, path.AppendChild("grasps"), twin)
    set_display_color(visual, twin.visual)
    label_prims(stage, root, twin)
    describe_asset(stage, twin)
    return stage, materials.textures


def crate(layer: Sdf.Layer) -> bytes:
    """Return a layer in USD's binary form, which the library writes to files only."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "layer.usdc"
        layer.Export(str(file))
        return file.read_bytes()


def _define_visual(stage: Usd.Stage, scope: Sdf.Path, part: trimesh.Trimesh, materials: PreviewMaterials) -> None:
    """Define a visual part; its seams of texture and creases are in face-varying values, its points are each one place."""
    name = unique_name(stage, scope, str(part.metadata.get("name") or "part"))
    mesh = UsdGeom.Mesh.Define(stage, scope.AppendChild(name))
    points, welded = _one_point_a_place(np.asarray(part.vertices, dtype=np.float32))
    corners = np.asarray(part.faces)
    corners = corners[_has_three_points(welded[corners])]
    write_topology(mesh, points, welded[corners])
    _write_normals(mesh, _unit_normals(part), corners, welded, len(points))
    uv = uv_of(part)
    if uv is not None:
        _write_texture_coordinates(mesh, uv, corners)
    source = material_of(part)
    mesh.CreateDoubleSidedAttr(bool(source.doubleSided))
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(materials.of(source))


def _one_point_a_place(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return each place once, in the order of first use, and the place of every vertex ``(V,)``."""
    positions = positions + np.float32(0)  # no negative zeros
    _, first, inverse = np.unique(positions, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return positions[first[order]], rank[inverse.reshape(-1)]


def _has_three_points(faces: np.ndarray) -> np.ndarray:
    return (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])


def _write_normals(
    mesh: UsdGeom.Mesh, normals: np.ndarray, corners: np.ndarray, welded: np.ndarray, points: int
) -> None:
    """Write a normal a point where no crease needs more, else one a corner."""
    by_point = np.zeros((points, 3), dtype=np.float32)
    by_point[:, 2] = 1.0  # a point that no face uses
    by_point[welded[corners]] = normals[corners]
    smooth = bool(np.array_equal(by_point[welded[corners]], normals[corners]))
    values = by_point if smooth else normals[corners].reshape(-1, 3)
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex if smooth else UsdGeom.Tokens.faceVarying)


def _write_texture_coordinates(mesh: UsdGeom.Mesh, uv: np.ndarray, corners: np.ndarray) -> None:
    places, inverse = _one_point_a_place(np.asarray(uv, dtype=np.float32)[corners.reshape(-1)])
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying
    )
    primvar.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(places)))
    primvar.SetIndices(Vt.IntArray.FromNumpy(inverse.astype(np.int32)))


def _unit_normals(part: trimesh.Trimesh) -> np.ndarray:
    """Return vertex normals ``(V, 3) float32``; +Z where no face gives one."""
    normals = np.array(part.vertex_normals, dtype=np.float64)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(lengths < 1e-6, (0.0, 0.0, 1.0), normals / np.maximum(lengths, 1e-6))
    return normals.astype(np.float32) + np.float32(0)


def _describe(stage: Usd.Stage, root: Usd.Prim, twin: TwinContent) -> None:
    """Say on the stage and on the prim what this is, where it came from, and how sure its numbers are."""
    record, physical, language = twin.record, twin.physical, twin.record.language
    caption = language.caption if language is not None else record.name or "an object"
    credit = f"; {record.source.attribution}" if record.source.attribution else ""
    origin = f"Source: {record.source.file} ({record.source.kind}), licence {record.source.license}{credit}."
    stage.GetRootLayer().documentation = f"{caption} {origin} Twin {record.twin_id}, revision {record.revision}."
    root.SetDocumentation(f"{caption} Metres, +Z up, standing on z = 0; the origin is at the bottom centre.")
    Usd.ModelAPI(root).SetAssetName(twin.name)
    Usd.ModelAPI(root).SetAssetVersion(record.revision)
    said: dict[str, Any] = {
        "twin_id": record.twin_id,
        "revision": record.revision,
        "manitwin_version": record.provenance.manitwin_version,
        "source": {"kind": record.source.kind, "file": record.source.file, "sha256": record.source.sha256},
        "license": record.source.license,
        "attribution": record.source.attribution or "",
        "material": physical.material,
        "mass_distribution": physical.mass_distribution,
        "density_kg_m3": physical.density_kg_m3,
        "mass_kg": _interval(physical.mass_kg),
        "friction_static": _interval(physical.friction_static),
        "friction_dynamic": _interval(physical.friction_dynamic),
        "restitution": _interval(physical.restitution),
    }
    if language is not None:
        said |= {"category": language.category, "caption": language.caption}
    root.SetCustomDataByKey("manitwin", said)


def _interval(estimate: Estimate) -> dict[str, Any]:
    return {"value": estimate.value, "low": estimate.low, "high": estimate.high, "source": estimate.source}


def define_rigid_body(root: Usd.Prim, twin: TwinContent) -> None:
    """Make the root prim a rigid body with mass, centre of mass and full inertia.

    The inertia is ``R diag(diagonalInertia) R^T`` about the centre of mass, ``R`` the rotation of ``principalAxes``.
    Source: UsdPhysics schema, MassAPI.
    """
    UsdPhysics.RigidBodyAPI.Apply(root)
    mass = UsdPhysics.MassAPI.Apply(root)
    moments, axes_wxyz = principal_axes(np.array(twin.physical.inertia_kg_m2))
    mass.CreateMassAttr(twin.physical.mass_kg.value)
    mass.CreateCenterOfMassAttr(Gf.Vec3f(*twin.physical.center_of_mass_m))
    mass.CreateDiagonalInertiaAttr(Gf.Vec3f(*moments.tolist()))
    mass.CreatePrincipalAxesAttr(Gf.Quatf(*axes_wxyz.tolist()))  # Gf.Quatf takes the real part first


def define_physics_material(stage: Usd.Stage, path: Sdf.Path, twin: TwinContent) -> UsdShade.Material:
    """Define the friction and restitution of the twin's surface; its density stays unsaid, for the mass is said."""
    material = UsdShade.Material.Define(stage, path)
    surface = UsdPhysics.MaterialAPI.Apply(material.GetPrim())
    surface.CreateStaticFrictionAttr(twin.physical.friction_static.value)
    surface.CreateDynamicFrictionAttr(twin.physical.friction_dynamic.value)
    surface.CreateRestitutionAttr(twin.physical.restitution.value)
    return material


def define_hulls(stage: Usd.Stage, scope: Sdf.Path, twin: TwinContent, material: UsdShade.Material) -> None:
    """Define every hull as a convex collider of its own below a scope that is not rendered."""
    UsdGeom.Scope.Define(stage, scope).CreatePurposeAttr(UsdGeom.Tokens.guide)
    for number, (vertices, faces) in enumerate(twin.hulls):
        mesh = UsdGeom.Mesh.Define(stage, scope.AppendChild(f"hull_{number:02d}"))
        points = np.asarray(vertices, dtype=np.float32)
        write_topology(mesh, points, faces)
        flat = trimesh.triangles.normals(np.asarray(vertices, np.float64)[faces])[0]
        mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(flat, dtype=np.float32)))
        mesh.SetNormalsInterpolation(UsdGeom.Tokens.uniform)
        UsdPhysics.CollisionAPI.Apply(mesh.GetPrim())
        UsdPhysics.MeshCollisionAPI.Apply(mesh.GetPrim()).CreateApproximationAttr(UsdPhysics.Tokens.convexHull)
        for schema in RUNTIME_COLLIDERS:
            mesh.GetPrim().AddAppliedSchema(schema)
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material, materialPurpose="physics")


def write_topology(mesh: UsdGeom.Mesh, points: np.ndarray, faces: np.ndarray) -> None:
    """Write triangles as they are: ``points (V, 3) float32``, ``faces (F, 3)``, nothing subdivided."""
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), 3, dtype=np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(faces, dtype=np.int32).reshape(-1)))
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.array([points.min(0), points.max(0)], dtype=np.float32)))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateOrientationAttr(UsdGeom.Tokens.rightHanded)
