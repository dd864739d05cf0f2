"""A twin's body in any SAPIEN scene: its hulls, its own mass properties and friction, and its textured mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import sapien
from sapien import physx

from manitwin.geometry.poses import GLTF_TO_OBJECT, quaternion_wxyz
from manitwin.simulate.convex_shape import convex_shape
from manitwin.twin import Physical


def principal_frame(inertia_kg_m2: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the principal moments ``(3,)`` ascending and the right-handed rotation ``(3, 3)`` of their axes to the object's."""
    moments, axes = np.linalg.eigh(inertia_kg_m2)
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    return moments, axes


def add_body(
    scene: Any,
    hulls: list[np.ndarray],
    physical: Physical,
    *,
    pose: Any = None,
    visual_glb: Path | None = None,
    name: str = "",
) -> Any:
    """Add a dynamic rigid body to a SAPIEN scene and return its entity.

    ``hulls`` are convex vertices ``(V, 3)`` in the object frame; mass, centre of mass and the full inertia come from
    ``physical``, not from the hulls. ``pose`` (sapien.Pose) is that of the object frame. ``visual_glb`` is a Y-up glTF file.
    """
    material = physx.PhysxMaterial(
        physical.friction_static.value, physical.friction_dynamic.value, physical.restitution.value
    )
    body = physx.PhysxRigidDynamicComponent()
    for vertices in hulls:
        body.attach(convex_shape(vertices, material))
    moments, axes = principal_frame(np.array(physical.inertia_kg_m2))
    body.set_mass(physical.mass_kg.value)
    body.set_cmass_local_pose(sapien.Pose(physical.center_of_mass_m, quaternion_wxyz(axes)))
    body.set_inertia(moments.astype(np.float32))
    entity = sapien.Entity()
    entity.name = name
    entity.add_component(body)
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
