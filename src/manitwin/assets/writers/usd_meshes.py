"""Meshes of a twin in a USD stage: visual meshes with their materials, and convex collision hulls."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import trimesh
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt

from manitwin.assets.writers.usd_materials import PreviewMaterials, unique_name
from manitwin.formats.meshes.textures import material_of, uv_of

RUNTIME_COLLIDERS = ("MjcCollisionAPI", "NewtonCollisionAPI", "NewtonMeshCollisionAPI")
"""Applied schemas that mark a collider for the importers of MuJoCo and Newton; all their attributes have default values."""


def define_visual(
    stage: Usd.Stage, scope: Sdf.Path, part: trimesh.Trimesh, materials: PreviewMaterials, origin_m: np.ndarray
) -> None:
    """Define a visual part below a frame whose origin is at ``origin_m`` in the object frame.

    Coincident vertices become one point; texture seams and creases are kept as face-varying values.
    """
    name = unique_name(stage, scope, str(part.metadata.get("name") or "part"))
    mesh = UsdGeom.Mesh.Define(stage, scope.AppendChild(name))
    points, welded = _weld_positions(np.asarray(part.vertices - origin_m, dtype=np.float32))
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


def _weld_positions(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return distinct positions in order of first use, and the index of the position of every vertex ``(V,)``."""
    positions = positions + np.float32(0)  # avoids negative zeros
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
    """Write one normal for each point if there are no creases, otherwise one for each face corner."""
    by_point = np.zeros((points, 3), dtype=np.float32)
    by_point[:, 2] = 1.0  # for points that no face uses
    by_point[welded[corners]] = normals[corners]
    smooth = bool(np.array_equal(by_point[welded[corners]], normals[corners]))
    values = by_point if smooth else normals[corners].reshape(-1, 3)
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex if smooth else UsdGeom.Tokens.faceVarying)


def _write_texture_coordinates(mesh: UsdGeom.Mesh, uv: np.ndarray, corners: np.ndarray) -> None:
    places, inverse = _weld_positions(np.asarray(uv, dtype=np.float32)[corners.reshape(-1)])
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying
    )
    primvar.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(places)))
    primvar.SetIndices(Vt.IntArray.FromNumpy(inverse.astype(np.int32)))


def _unit_normals(part: trimesh.Trimesh) -> np.ndarray:
    """Return unit vertex normals ``(V, 3) float32``; +Z where the faces define none."""
    normals = np.array(part.vertex_normals, dtype=np.float64)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(lengths < 1e-6, (0.0, 0.0, 1.0), normals / np.maximum(lengths, 1e-6))
    return normals.astype(np.float32) + np.float32(0)


def define_hulls(
    stage: Usd.Stage,
    scope: Sdf.Path,
    hulls: Mapping[int, tuple[np.ndarray, np.ndarray]],
    material: UsdShade.Material,
    origin_m: np.ndarray,
) -> None:
    """Define numbered hulls, each a convex collider, below a scope that is not rendered.

    Their vertices are in the object frame, where the origin of the scope's frame is at ``origin_m``.
    """
    UsdGeom.Scope.Define(stage, scope).CreatePurposeAttr(UsdGeom.Tokens.guide)
    for number, (vertices, faces) in hulls.items():
        mesh = UsdGeom.Mesh.Define(stage, scope.AppendChild(f"hull_{number:02d}"))
        points = np.asarray(vertices - origin_m, dtype=np.float32)
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
    """Write triangles without subdivision: ``points (V, 3) float32``, ``faces (F, 3)``."""
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), 3, dtype=np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(faces, dtype=np.int32).reshape(-1)))
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.array([points.min(0), points.max(0)], dtype=np.float32)))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateOrientationAttr(UsdGeom.Tokens.rightHanded)
