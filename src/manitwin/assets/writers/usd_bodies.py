"""Rigid bodies of a twin in a USD stage: a single body, or one for each link with joints between them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import trimesh
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade
from scipy.spatial.transform import Rotation

from manitwin.assets.writers.exporter import TwinContent
from manitwin.assets.writers.mass_properties import TwinInertial, inertial_of_link, principal_axes
from manitwin.assets.writers.simready import set_display_color
from manitwin.assets.writers.usd_materials import PreviewMaterials, unique_name
from manitwin.assets.writers.usd_meshes import define_hulls, define_visual
from manitwin.geometry.articulation import ArticulatedJoint
from manitwin.geometry.poses import rotation_between
from manitwin.twin.loaded_links import joints_of

LINKS, JOINTS = "links", "joints"
_ALONG = np.array([1.0, 0, 0])
"""The axis of every joint in its own frame: UsdPhysics supports X, Y and Z."""


def define_rigid_twin(
    stage: Usd.Stage, path: Sdf.Path, twin: TwinContent, materials: PreviewMaterials, friction: UsdShade.Material
) -> None:
    """Make the prim at a path a rigid body, with its shapes below it."""
    physical = twin.physical
    tensor = np.array(physical.inertia_kg_m2)
    inertial = TwinInertial(
        physical.mass_kg.value, np.array(physical.center_of_mass_m), tensor, *principal_axes(tensor)
    )
    _define_body(stage.GetPrimAtPath(path), inertial, np.zeros(3))
    _define_shapes(stage, path, twin, twin.visual, range(len(twin.hulls)), materials, friction, np.zeros(3))


def define_links(
    stage: Usd.Stage, path: Sdf.Path, twin: TwinContent, materials: PreviewMaterials, friction: UsdShade.Material
) -> None:
    """Make the prim at a path an articulation: a body for each link, in a frame at its joint, and the joints between them.

    The stage has the present pose of the twin; the two frames of a joint coincide at position 0. Raises ExportError for mass
    properties that are impossible for a rigid body. Sources: UsdPhysics schema, ArticulationRootAPI, RevoluteJoint,
    PrismaticJoint, DriveAPI (a drive without stiffness is a damper, per degree); MuJoCo's OpenUSD documentation, MjcJointAPI;
    newton-usd-schemas 0.6, NewtonJointAPI; PhysxSchema, PhysxJointAPI (degrees per second).
    """
    UsdPhysics.ArticulationRootAPI.Apply(stage.GetPrimAtPath(path))
    joints, links = joints_of(twin.record), twin.record.links
    scope = UsdGeom.Scope.Define(stage, path.AppendChild(LINKS)).GetPath()
    origins = [np.zeros(3), *(joint.origin_m for joint in joints)]
    bodies: list[Sdf.Path] = []
    for place, link in enumerate(links):
        body = UsdGeom.Xform.Define(stage, scope.AppendChild(unique_name(stage, scope, link.name)))
        body.AddTranslateOp().Set(Gf.Vec3d(*origins[place].tolist()))
        _set_display_name(body.GetPrim(), link.name)
        bodies.append(body.GetPath())
        _define_body(body.GetPrim(), inertial_of_link(twin, link), origins[place])
        parts = [part for part, of in zip(twin.visual, twin.link_of_visual, strict=True) if of == place]
        _define_shapes(stage, body.GetPath(), twin, parts, link.hulls, materials, friction, origins[place])
    scope = UsdGeom.Scope.Define(stage, path.AppendChild(JOINTS)).GetPath()
    for joint in joints:
        ends = (joint.parent, joint.child)
        made = scope.AppendChild(unique_name(stage, scope, joint.name))
        _define_joint(stage, made, joint, [bodies[end] for end in ends], [origins[end] for end in ends])


def _set_display_name(prim: Usd.Prim, name: str) -> None:
    """Set the display name of a prim whose name is not a valid USD identifier."""
    if prim.GetName() != name:
        prim.SetDisplayName(name)


def _define_body(prim: Usd.Prim, inertial: TwinInertial, origin_m: np.ndarray) -> None:
    """Make a prim with its origin at ``origin_m`` a rigid body with mass, centre of mass and full inertia.

    The inertia is ``R diag(diagonalInertia) R^T`` about the centre of mass, with ``R`` the rotation of ``principalAxes``.
    Source: UsdPhysics schema, MassAPI.
    """
    UsdPhysics.RigidBodyAPI.Apply(prim)
    mass = UsdPhysics.MassAPI.Apply(prim)
    mass.CreateMassAttr(inertial.mass_kg)
    mass.CreateCenterOfMassAttr(Gf.Vec3f(*(inertial.center_of_mass_m - origin_m).tolist()))
    mass.CreateDiagonalInertiaAttr(Gf.Vec3f(*inertial.principal_moments_kg_m2.tolist()))
    mass.CreatePrincipalAxesAttr(Gf.Quatf(*inertial.principal_axes_wxyz.tolist()))  # Gf.Quatf takes the real part first


def _define_shapes(
    stage: Usd.Stage,
    body: Sdf.Path,
    twin: TwinContent,
    parts: Sequence[trimesh.Trimesh],
    hulls: Sequence[int],
    materials: PreviewMaterials,
    friction: UsdShade.Material,
    origin_m: np.ndarray,
) -> None:
    visual = UsdGeom.Scope.Define(stage, body.AppendChild("visual"))
    for part in parts:
        define_visual(stage, visual.GetPath(), part, materials, origin_m)
    set_display_color(visual, tuple(parts))
    chosen = {number: twin.hulls[number] for number in hulls}
    define_hulls(stage, body.AppendChild("collision"), chosen, friction, origin_m)


def _define_joint(
    stage: Usd.Stage, path: Sdf.Path, joint: ArticulatedJoint, bodies: list[Sdf.Path], origins: list[np.ndarray]
) -> None:
    slides = joint.kind == "prismatic"
    made = (UsdPhysics.PrismaticJoint if slides else UsdPhysics.RevoluteJoint).Define(stage, path)
    made.CreateAxisAttr(UsdPhysics.Tokens.x)
    made.CreateBody0Rel().SetTargets([bodies[0]])
    made.CreateBody1Rel().SetTargets([bodies[1]])
    turn = Rotation.from_matrix(rotation_between(_ALONG, joint.axis))
    way = np.zeros(3) if not slides else joint.stands_at * joint.axis
    turned = turn if slides else turn * Rotation.from_rotvec(joint.stands_at * _ALONG)
    made.CreateLocalPos0Attr(Gf.Vec3f(*(joint.origin_m - origins[0]).tolist()))
    made.CreateLocalRot0Attr(Gf.Quatf(*turn.as_quat(scalar_first=True).tolist()))
    made.CreateLocalPos1Attr(Gf.Vec3f(*(joint.origin_m + way - origins[1]).tolist()))
    made.CreateLocalRot1Attr(Gf.Quatf(*turned.as_quat(scalar_first=True).tolist()))
    unit = 1.0 if slides else math.radians(1.0)
    if joint.lower is not None and joint.upper is not None:
        made.CreateLowerLimitAttr(joint.lower / unit)
        made.CreateUpperLimitAttr(joint.upper / unit)
    prim = made.GetPrim()
    _set_display_name(prim, joint.name)
    if joint.damping or joint.effort is not None:
        drive = UsdPhysics.DriveAPI.Apply(prim, UsdPhysics.Tokens.linear if slides else UsdPhysics.Tokens.angular)
        drive.CreateTypeAttr(UsdPhysics.Tokens.force)
        drive.CreateStiffnessAttr(0.0)
        drive.CreateDampingAttr(joint.damping * unit)
        if joint.effort is not None:
            drive.CreateMaxForceAttr(joint.effort)
    for schema, name, value in (
        ("MjcJointAPI", "mjc:frictionloss", joint.friction or None),
        ("NewtonJointAPI", "newton:friction", joint.friction or None),
        ("PhysxJointAPI", "physxJoint:maxJointVelocity", None if joint.velocity is None else joint.velocity / unit),
    ):
        if value is not None:
            prim.AddAppliedSchema(schema)
            kind = Sdf.ValueTypeNames.Double if schema == "MjcJointAPI" else Sdf.ValueTypeNames.Float
            prim.CreateAttribute(name, kind, False).Set(value)
