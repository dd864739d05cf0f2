"""Articulations in SAPIEN: hands and robots built from the links of a URDF, without gravity on the links.

They are not built by SAPIEN's URDF loader, which couples mimic joints, resolves mesh paths itself and cooks meshes anew each
time. Gravity is off because controllers compensate it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import sapien
from sapien import physx

from manitwin.physics.sapien.shapes import HAND_COLLISION_GROUPS, convex_shape, set_contact
from manitwin.robots.links import Link, LinkShape

LEAST_MASS_KG, LEAST_MOMENT_KG_M2 = 0.01, 1e-6
"""Lower bounds for URDF links without mass, which PhysX rejects."""


@dataclass(frozen=True)
class LinkContact:
    """Contact properties of a link: material, whether it is a soft pad, and SAPIEN collision groups."""

    material: physx.PhysxMaterial
    soft_pad: bool = False
    collision_groups: tuple[int, ...] = HAND_COLLISION_GROUPS


def build_articulation(
    scene: sapien.Scene,
    links: Sequence[Link],
    contact_of: Callable[[Link], LinkContact],
    *,
    contact_offset_m: float,
    root_to_scene: np.ndarray | None = None,
) -> dict[str, physx.PhysxArticulationLinkComponent]:
    """Build links, parents before children, with the root fixed at a pose ``(4, 4)``; return the components by name."""
    built: list[physx.PhysxArticulationLinkComponent] = []
    entities = []
    for link in links:
        component = physx.PhysxArticulationLinkComponent(built[link.parent] if link.parent >= 0 else None)
        contact = contact_of(link)
        for shape in link.shapes:
            part = _link_shape(shape, contact.material)
            part.local_pose = sapien.Pose(shape.shape_to_link)
            set_contact(
                part,
                contact_offset_m=contact_offset_m,
                soft_pad=contact.soft_pad,
                collision_groups=contact.collision_groups,
            )
            component.attach(part)
        _set_joint_and_mass(component, link)
        component.disable_gravity = True
        built.append(component)
        entity = sapien.Entity()
        entity.name = link.name
        entity.add_component(component)
        entities.append(entity)
    if root_to_scene is not None:
        entities[0].pose = sapien.Pose(root_to_scene)
    for entity in entities:
        scene.add_entity(entity)
    return {link.name: component for link, component in zip(links, built, strict=True)}


def drive_joints(
    joints: Sequence[physx.PhysxArticulationJoint],
    *,
    stiffness: float,
    damping: float,
    limit: float,
    armature: float,
) -> None:
    """Give joints a PD drive of limited force, and the motors' armature inertia.

    Units are N m and rad, or N and m for prismatic joints.
    """
    for joint in joints:
        joint.set_drive_properties(stiffness, damping, limit)
        joint.set_armature(np.full(1, armature, np.float32))


def _link_shape(shape: LinkShape, material: physx.PhysxMaterial) -> physx.PhysxCollisionShape:
    """Return a link's collision shape in the shape's own frame."""
    if shape.half_extents_m is not None:
        return physx.PhysxCollisionShapeBox(shape.half_extents_m.astype(np.float32), material)
    if shape.radius_m is not None:
        return physx.PhysxCollisionShapeSphere(shape.radius_m, material)
    if shape.corners_m is None:
        raise AssertionError("a shape is a box, a sphere or corners")
    return convex_shape(shape.corners_m, material)


def _set_joint_and_mass(component: physx.PhysxArticulationLinkComponent, link: Link) -> None:
    """Set a component's name, joint and mass properties."""
    component.name = link.name
    component.joint.name = link.joint
    component.joint.type = "revolute_unwrapped" if link.joint_type == "continuous" else link.joint_type
    if link.parent >= 0:
        component.joint.pose_in_parent = sapien.Pose(link.joint_to_parent)
        component.joint.pose_in_child = sapien.Pose(link.joint_to_link)
    if link.joint_type in ("revolute", "prismatic"):
        component.joint.limit = np.array(link.limits, np.float32)
    component.set_mass(max(link.mass_kg, LEAST_MASS_KG))
    axes = np.eye(4)
    axes[:3, :3], axes[:3, 3] = link.principal_axes, link.center_of_mass_m
    component.set_cmass_local_pose(sapien.Pose(axes))
    component.set_inertia(np.maximum(link.moments_kg_m2, LEAST_MOMENT_KG_M2).astype(np.float32))
