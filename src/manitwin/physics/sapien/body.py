"""Rigid bodies in SAPIEN: twins with their mass properties and friction, furniture boxes, and the ground plane."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import sapien
from sapien import physx

from manitwin.geometry.poses import quaternion_wxyz
from manitwin.geometry.rigid_body import FURNITURE_FRICTION, RigidBody, StaticBox
from manitwin.physics.sapien.shapes import HullShapes, hull_shapes, set_contact

CONTACT_OFFSET_M = 0.002
"""With SAPIEN's default of 10 mm, a step costs 1.6 times as much for the same result. PhysX may also take two thin bodies 14
mm apart for deeply overlapping and throw them across the room: 1 of 250 layouts of real twins.
"""

SOLVER_ITERATIONS = 20
"""With PhysX's default of 4 to 10, stacks of hulls creep."""

# Measured on boxes of 2 kg on boxes of 40 to 5 g, at 1/120 s: mass ratios of 60, 100, 200 and 400 need 20, 40, 80 and 160
# iterations to stay within 0.2 mm. With half as many, the upper box sinks in by millimetres, or through to the table.
ITERATIONS_PER_MASS_RATIO, MOST_ITERATIONS = 0.6, 255

# At 1 m/s the solver cannot push an object of 10 g off fingers that close with 50 N: 7 of 20 grasps of a sponge sank in or
# were lost, none of them at 5 or 100 m/s. Four of these were tried at 1/960 s and 40 iterations, and all four held.
MAX_DEPENETRATION_M_S = 5.0
ANGULAR_DAMPING_PER_S = 0.05  # of graspable objects

_PLANE_TO_WORLD = np.array([[0.0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]])  # PhysX's planes face +X


def iterations_beside(masses_kg: Sequence[float], least: int) -> list[int]:
    """Return the solver iterations that each body needs to support the heaviest other body; at least ``least``.

    PhysX solves bodies in contact with the largest number among them.
    """
    found = []
    for number, mass_kg in enumerate(masses_kg):
        heaviest_kg = max((each for other, each in enumerate(masses_kg) if other != number), default=0.0)
        needed = int(np.ceil(ITERATIONS_PER_MASS_RATIO * heaviest_kg / mass_kg))
        found.append(max(least, min(needed, MOST_ITERATIONS)))
    return found


def dynamic_component(
    body: RigidBody,
    shapes: HullShapes,
    *,
    contact_offset_m: float | None = None,
    restitution: float = 0.0,
    soft_pad: bool = False,
) -> physx.PhysxRigidDynamicComponent:
    """Return the body as a dynamic component with its own mass properties; SAPIEN would derive them from the shapes.

    ``shapes`` are those of all its hulls, or of a relevant subset. Without ``contact_offset_m`` the scene's default applies.
    ``soft_pad`` is for objects that a hand grasps (``shapes.set_contact``). Raises RuntimeError if a shape belongs to another
    component.
    """
    material = physx.PhysxMaterial(body.friction_static, body.friction_dynamic, restitution)
    component = physx.PhysxRigidDynamicComponent()
    moments, axes_wxyz = body.principal_inertia
    component.set_mass(body.mass_kg)
    component.set_cmass_local_pose(sapien.Pose(body.center_of_mass_m, axes_wxyz))
    component.set_inertia(moments.astype(np.float32))
    for shape in shapes:
        shape.local_pose = sapien.Pose()  # raises while attached to another component; attaching would fail silently
        shape.physical_material = material
        set_contact(shape, contact_offset_m=contact_offset_m, soft_pad=soft_pad)
        component.attach(shape)
    return component


def graspable_component(
    body: RigidBody, shapes: HullShapes, *, contact_offset_m: float, solver_iterations: int
) -> physx.PhysxRigidDynamicComponent:
    """Return the body as a component for grasping, with the torsional friction of soft pads."""
    component = dynamic_component(body, shapes, contact_offset_m=contact_offset_m, soft_pad=True)
    component.solver_position_iterations = solver_iterations
    component.solver_velocity_iterations = 1
    component.max_depenetration_velocity = MAX_DEPENETRATION_M_S
    component.set_linear_damping(0.0)
    component.set_angular_damping(ANGULAR_DAMPING_PER_S)
    return component


def add_body(
    scene: Any,
    body: RigidBody,
    *,
    restitution: float,
    pose: Any = None,
    contact_offset_m: float | None = None,
    visual_glb: Path | None = None,
    name: str = "",
) -> Any:
    """Add a dynamic rigid body to a SAPIEN scene and return its entity.

    ``pose`` (sapien.Pose) is that of the object frame. ``visual_glb`` is a Y-up glTF file.
    """
    entity = sapien.Entity()
    entity.name = name
    shapes = hull_shapes(body.hulls)
    entity.add_component(dynamic_component(body, shapes, contact_offset_m=contact_offset_m, restitution=restitution))
    if visual_glb is not None:
        from manitwin.physics.sapien.visuals import glb_visual

        entity.add_component(glb_visual(visual_glb))
    if pose is not None:
        entity.set_pose(pose)
    scene.add_entity(entity)
    return entity


def static_box(box: StaticBox, *, contact_offset_m: float, friction: float = FURNITURE_FRICTION) -> sapien.Entity:
    """Return a furniture box as an entity not yet in a scene; ``friction`` is static and dynamic."""
    shape = physx.PhysxCollisionShapeBox(box.half_extents_m, physx.PhysxMaterial(friction, friction, 0.0))
    pose = sapien.Pose(box.box_to_world[:3, 3], quaternion_wxyz(box.box_to_world[:3, :3]))
    return _static(shape, pose, contact_offset_m, box.name)


def static_plane(
    friction_static: float, friction_dynamic: float, *, contact_offset_m: float | None = None, name: str = "ground"
) -> sapien.Entity:
    """Return the plane z = 0, solid below, as an entity not yet in a scene."""
    shape = physx.PhysxCollisionShapePlane(physx.PhysxMaterial(friction_static, friction_dynamic, 0.0))
    return _static(shape, sapien.Pose(_PLANE_TO_WORLD), contact_offset_m, name)


def _static(
    shape: physx.PhysxCollisionShape, pose: sapien.Pose, contact_offset_m: float | None, name: str
) -> sapien.Entity:
    set_contact(shape, contact_offset_m=contact_offset_m)
    component = physx.PhysxRigidStaticComponent()
    component.attach(shape)
    return entity_at(component, pose, name)


def entity_at(component: sapien.Component, pose: sapien.Pose, name: str = "") -> sapien.Entity:
    """Return an entity with one component at a pose, not yet in a scene."""
    entity = sapien.Entity()
    entity.name = name
    entity.add_component(component)
    entity.pose = pose
    return entity
