"""Links of a URDF as those of a SAPIEN articulation: their shapes, joints and masses."""

from __future__ import annotations

import numpy as np
import sapien
from sapien import physx

from manitwin.physics.convex_shape import convex_shape
from manitwin.robots.links import Link, LinkShape

LEAST_MASS_KG, LEAST_MOMENT_KG_M2 = 0.01, 1e-6
"""Of URDF's links without mass, which PhysX refuses."""


def link_shape(shape: LinkShape, material: physx.PhysxMaterial) -> physx.PhysxCollisionShape:
    """Return a link's shape, in its own frame still."""
    if shape.half_extents_m is not None:
        return physx.PhysxCollisionShapeBox(shape.half_extents_m.astype(np.float32), material)
    if shape.radius_m is not None:
        return physx.PhysxCollisionShapeSphere(shape.radius_m, material)
    if shape.corners_m is None:
        raise AssertionError("a shape is a box, a sphere or corners")
    return convex_shape(shape.corners_m, material)


def set_joint_and_mass(component: physx.PhysxArticulationLinkComponent, link: Link) -> None:
    """Give a component its name, joint and mass properties."""
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
