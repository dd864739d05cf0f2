"""A rigid body in SAPIEN: its hulls, its own mass properties and friction, and its textured mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import sapien
from sapien import physx

from manitwin.geometry.poses import GLTF_TO_OBJECT
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.convex_shape import convex_shape


def hull_shapes(hulls: tuple[np.ndarray, ...]) -> list[physx.PhysxCollisionShapeConvexMesh]:
    """Cook hulls, each ``(V, 3)`` m, at 0.2 ms a hull; the component that takes them gives them its material.

    A shape belongs to one component at a time, and is free again when that is gone.
    """
    return [convex_shape(hull, physx.get_default_material()) for hull in hulls]


def dynamic_component(
    body: RigidBody,
    shapes: list[physx.PhysxCollisionShapeConvexMesh],
    *,
    contact_offset_m: float | None = None,
    restitution: float = 0.0,
) -> physx.PhysxRigidDynamicComponent:
    """Return the body as a component; SAPIEN would take the mass properties from the shapes, so they are set first.

    ``shapes`` are those of its hulls, or of the ones that matter. Without ``contact_offset_m`` the scene's own applies.
    Raises RuntimeError where a shape belongs to another component.
    """
    material = physx.PhysxMaterial(body.friction_static, body.friction_dynamic, restitution)
    component = physx.PhysxRigidDynamicComponent()
    moments, axes_wxyz = body.principal_inertia
    component.set_mass(body.mass_kg)
    component.set_cmass_local_pose(sapien.Pose(body.center_of_mass_m, axes_wxyz))
    component.set_inertia(moments.astype(np.float32))
    for shape in shapes:
        shape.local_pose = sapien.Pose()  # refused while attached elsewhere; attaching would fail without a word
        shape.physical_material = material
        if contact_offset_m is not None:
            shape.contact_offset = contact_offset_m
        component.attach(shape)
    return component


def add_body(
    scene: Any,
    body: RigidBody,
    *,
    restitution: float,
    pose: Any = None,
    visual_glb: Path | None = None,
    name: str = "",
) -> Any:
    """Add a dynamic rigid body to a SAPIEN scene and return its entity.

    ``pose`` (sapien.Pose) is that of the object frame. ``visual_glb`` is a Y-up glTF file.
    """
    entity = sapien.Entity()
    entity.name = name
    entity.add_component(dynamic_component(body, hull_shapes(body.hulls), restitution=restitution))
    if visual_glb is not None:
        from sapien import render

        shape = render.RenderShapeTriangleMesh(str(visual_glb))
        shape.local_pose = sapien.Pose(GLTF_TO_OBJECT)
        component = render.RenderBodyComponent()
        component.attach(shape)
        entity.add_component(component)
    if pose is not None:
        entity.set_pose(pose)
    scene.add_entity(entity)
    return entity
