"""A rigid body in SAPIEN: its hulls, its own mass properties and friction, and its textured mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import sapien
from sapien import physx

from manitwin.geometry.poses import GLTF_TO_OBJECT, quaternion_wxyz
from manitwin.simulate.convex_shape import convex_shape
from manitwin.simulate.rigid_body import RigidBody, principal_frame


def dynamic_component(
    body: RigidBody, *, contact_offset_m: float | None = None, restitution: float = 0.0
) -> physx.PhysxRigidDynamicComponent:
    """Return the body as a component; SAPIEN would take the mass properties from the hulls, so they are set.

    Without ``contact_offset_m`` the scene's own applies.
    """
    material = physx.PhysxMaterial(body.friction_static, body.friction_dynamic, restitution)
    component = physx.PhysxRigidDynamicComponent()
    for hull in body.hulls:
        shape = convex_shape(hull, material)
        if contact_offset_m is not None:
            shape.contact_offset = contact_offset_m
        component.attach(shape)
    moments, axes = principal_frame(body.inertia_kg_m2)
    component.set_mass(body.mass_kg)
    component.set_cmass_local_pose(sapien.Pose(body.center_of_mass_m, quaternion_wxyz(axes)))
    component.set_inertia(moments.astype(np.float32))
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
    entity.add_component(dynamic_component(body, restitution=restitution))
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
