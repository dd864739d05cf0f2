"""What UsdPhysics says of a twin: one rigid body, its mass properties, its hulls and what they are made of."""

from __future__ import annotations

import numpy as np
import trimesh
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt

from manitwin.assets.writers.content import TwinContent
from manitwin.assets.writers.principal_axes import principal_axes


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
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material, materialPurpose="physics")


def write_topology(mesh: UsdGeom.Mesh, points: np.ndarray, faces: np.ndarray) -> None:
    """Write triangles as they are: ``points (V, 3) float32``, ``faces (F, 3)``, nothing subdivided."""
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), 3, dtype=np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(faces, dtype=np.int32).reshape(-1)))
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.array([points.min(0), points.max(0)], dtype=np.float32)))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateOrientationAttr(UsdGeom.Tokens.rightHanded)
