"""Grasps by how much the target's weight turns it in the jaws as it is lifted from where it lies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manitwin.episodes.planning.problem import Grasp
from manitwin.geometry.poses import transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.trial import GRAVITY_M_S2
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.parallel import ParallelGripper


def steady_tiers(grasps: Sequence[Grasp], target: PlacedObject, gripper: Gripper) -> list[tuple[Grasp, ...]]:
    """Return grasps in two tiers, each in their order: those that bear the target's weight where it is, and the doubtful.

    The doubtful bear it where pads lie flat on it. Left out are those in which a target that is lifted turns about the jaws'
    axis in any case. The trial of a grasp does not say so: one that lies is held at its end. A tier without grasps is left
    out too; of other grippers than jaws there is one.
    """
    if not isinstance(gripper, ParallelGripper):
        return [tuple(grasps)] if grasps else []
    torques_nm = [weight_torque_nm(each, target, gripper) for each in grasps]
    line_nm, face_nm = torsion_limits_nm(gripper)
    both = list(zip(grasps, torques_nm, strict=True))
    tiers = (
        tuple(each for each, nm in both if nm <= line_nm),
        tuple(each for each, nm in both if line_nm < nm <= face_nm),
    )
    return [tier for tier in tiers if tier]


def bears_weight(grasp: Grasp, target: PlacedObject, gripper: Gripper) -> bool:
    """Tell whether a target that is lifted where it is stays as it is in the jaws; of other grippers nothing is known."""
    if not isinstance(gripper, ParallelGripper):
        return True
    return weight_torque_nm(grasp, target, gripper) <= torsion_limits_nm(gripper)[0]


def torsion_limits_nm(gripper: ParallelGripper) -> tuple[float, float]:
    """Return the torque about the closing axis that two pads bear by friction, on a line and on a flat face.

    Pressure is even. On a line across the pad, as of a bottle, 2 * mu F l / 4 with its shorter side l; on a face 2 * 2/3 mu F r
    with the radius of a disc of its area: the limit surface of Howe and Cutkosky, Practical force-motion models for sliding
    manipulation, 1996.
    """
    across_m, along_m = gripper.pad_half_extents_m
    friction_n = gripper.finger_friction * gripper.force_n
    radius_m = float(np.sqrt(4 * across_m * along_m / np.pi))
    return friction_n * min(across_m, along_m), 2 * (2 / 3) * friction_n * radius_m


def weight_torque_nm(grasp: Grasp, target: PlacedObject, gripper: Gripper) -> float:
    """Return the torque of a target's weight about the closing axis through the pads, where it is."""
    hand = target.object_to_world @ grasp.gripper_to_object
    tip = transform_points(hand, np.array([[0.0, 0, gripper.tip_depth_m]]))[0]
    center = transform_points(target.object_to_world, target.body.center_of_mass_m[None])[0]
    weight_n = np.array([0.0, 0, -GRAVITY_M_S2 * target.body.mass_kg])
    return abs(float(np.cross(center - tip, weight_n) @ hand[:3, 0]))
