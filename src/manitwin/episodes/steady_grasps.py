"""Grasps by how much the target's weight turns it in the jaws as it is lifted from where it lies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manitwin.episodes.planning.problem import Grasp
from manitwin.geometry.poses import transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.rigid_body import PlacedObject, RigidBody
from manitwin.physics.grasp_filters import MIN_CELLS, PAD_CELLS, PadContacts, pad_contacts
from manitwin.physics.trial import GRAVITY_M_S2
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.parallel import ParallelGripper

LEAST_APART_M = 0.04  # of the pads of two hands on one thing
EDGE_M = 0.002  # from the pads' ends: by their last row of cells alone
LIFT_ACCELERATION_M_S2 = 2.0  # of 30 planned lifts in layouts 1.1 in the median and 1.9 at most
LIFTED_WEIGHT = 1 + LIFT_ACCELERATION_M_S2 / GRAVITY_M_S2
"""What bears on the jaws as a thing is lifted, as a multiple of its weight."""
BROAD_SHARE = 0.4  # of a pad's rays: on fewer, fewer of the verified grasps hold, too (``physics.grasp_filters``)


def steady_tiers(grasps: Sequence[Grasp], target: PlacedObject, gripper: Gripper) -> list[tuple[Grasp, ...]]:
    """Return grasps in two tiers, each in their order: those that bear to lift the target where it is, and the doubtful.

    The doubtful bear it where pads lie flat on it, as a disc of the area that touches does. Left out are those in which a target
    that is lifted turns about the jaws' axis. The trial of a grasp does not say so: one that lies is held at its end. A tier
    without grasps is left out too; of other grippers than jaws there is one.
    """
    if not isinstance(gripper, ParallelGripper):
        return [tuple(grasps)] if grasps else []
    torques_nm = [LIFTED_WEIGHT * weight_torque_nm(each, target, gripper) for each in grasps]
    line_nm, face_nm = torsion_limits_nm(gripper)
    both = list(zip(grasps, torques_nm, strict=True))
    on_faces = [(each, nm) for each, nm in both if line_nm < nm <= face_nm]
    shares = touching_shares([each for each, _ in on_faces], target.body, gripper)
    tiers = (
        tuple(each for each, nm in both if nm <= line_nm),
        tuple(
            each for (each, nm), share in zip(on_faces, shares, strict=True) if nm <= face_nm * float(np.sqrt(share))
        ),
    )
    return [tier for tier in tiers if tier]


def steady_on_the_way(
    grasps: Sequence[Grasp], body: RigidBody, ways: Sequence[np.ndarray], gripper: Gripper
) -> list[Grasp]:
    """Return the grasps in which a body's weight does not turn it all along a way: those first that bear it on a line.

    ``ways`` are alternatives, each poses ``(K, 4, 4)`` of the body in the world; of each grasp the gentlest counts. On a face as
    much is borne as by a disc of the area that touches. A jug that stands hangs straight below jaws at its rim, and bears on them
    with its whole height once it is tilted to pour. Of other grippers than jaws nothing is known, and all are returned.
    """
    if not isinstance(gripper, ParallelGripper) or not grasps or not ways:
        return list(grasps)
    (line_nm, face_nm), tip_m = torsion_limits_nm(gripper), np.array([[0.0, 0, gripper.tip_depth_m]])
    on_lines, on_faces = list[Grasp](), list[Grasp]()
    for grasp, share in zip(grasps, touching_shares(grasps, body, gripper), strict=True):
        away_m = body.center_of_mass_m - transform_points(grasp.gripper_to_object, tip_m)[0]
        per_newton_m = np.cross(away_m, grasp.gripper_to_object[:3, 0])
        largest_m = min(float(np.abs(poses[:, 2, :3] @ per_newton_m).max()) for poses in ways)
        torque_nm = GRAVITY_M_S2 * body.mass_kg * largest_m
        if torque_nm <= line_nm:
            on_lines.append(grasp)
        elif torque_nm <= face_nm * float(np.sqrt(share)):
            on_faces.append(grasp)
    return on_lines + on_faces


def bears_weight(grasp: Grasp, target: PlacedObject, gripper: Gripper) -> bool:
    """Tell whether a target that is lifted where it is stays as it is in the jaws; of other grippers nothing is known."""
    if not isinstance(gripper, ParallelGripper):
        return True
    return LIFTED_WEIGHT * weight_torque_nm(grasp, target, gripper) <= torsion_limits_nm(gripper)[0]


def loads_any_way_up(grasps: Sequence[Grasp], body: RigidBody, gripper: Gripper) -> list[int | None]:
    """Return how the weight of what may be turned any way up loads each grasp, the less the better; None: it is not borne.

    The largest torque of the weight about the closing axis, in tenths of what two pads bear on a line, divided by the share of
    the pads that touches. It is borne as on a line where pads touch narrowly (``touch_narrowly``), as on a face else, and not
    by a corner of a pad, with no more cells than a grasp must have within 2 mm of its end: fingers miss what they reach over
    by so little. 0 of other grippers than jaws, of which nothing is known. Of 270 lifts, one in which things turned by more
    than 10 degrees has a larger load than one in which they did not in 79 of 100 pairs, a larger torque in 72.
    """
    if not isinstance(gripper, ParallelGripper) or not grasps:
        return [0] * len(grasps)
    line_nm, face_nm = torsion_limits_nm(gripper)
    tip_m, found = np.array([[0.0, 0, gripper.tip_depth_m]]), list[int | None]()
    contacts = _contacts(grasps, body, gripper)
    by_a_corner = (contacts.cells <= MIN_CELLS) & (contacts.from_end_m < EDGE_M) | (contacts.cells == 0)
    for grasp, cells, corner in zip(grasps, contacts.cells, by_a_corner, strict=True):
        pose = grasp.gripper_to_object
        away_m = body.center_of_mass_m - transform_points(pose, tip_m)[0]
        torque_nm = GRAVITY_M_S2 * body.mass_kg * float(np.linalg.norm(np.cross(away_m, pose[:3, 0])))
        limit_nm = line_nm if cells < BROAD_SHARE * PAD_CELLS else face_nm
        borne = not corner and torque_nm <= limit_nm
        found.append(int(10 * torque_nm / line_nm * PAD_CELLS / cells) if borne else None)
    return found


def pad_distances_m(grasp: Grasp, others: Sequence[Grasp], gripper: Gripper) -> np.ndarray:
    """Return how far the middle of a grasp's pads is from those of other grasps ``(N,)``."""
    tip_m = np.array([[0.0, 0, gripper.tip_depth_m]])
    tips = np.array([transform_points(each.gripper_to_object, tip_m)[0] for each in (grasp, *others)])
    return np.asarray(np.linalg.norm(tips[1:] - tips[0], axis=1))


def touch_narrowly(grasps: Sequence[Grasp], body: RigidBody, gripper: Gripper) -> list[bool]:
    """Tell of each grasp whether a pad touches by less than two fifths of it: about a point or a short line, things turn.

    Of 270 lifts of 48 things, 26 of the 158 such ones turned by more than 10 degrees, of the others 3 of 112. Of other
    grippers than jaws nothing is known.
    """
    if not isinstance(gripper, ParallelGripper):
        return [False] * len(grasps)
    return [share < BROAD_SHARE for share in touching_shares(grasps, body, gripper)]


def touching_shares(grasps: Sequence[Grasp], body: RigidBody, gripper: ParallelGripper) -> list[float]:
    """Return the share of the pads that touches in each grasp, of the pad that touches less."""
    return [int(cells) / PAD_CELLS for cells in _contacts(grasps, body, gripper).cells] if grasps else []


def _contacts(grasps: Sequence[Grasp], body: RigidBody, gripper: ParallelGripper) -> PadContacts:
    """Return how the pads touch."""
    poses = np.array([each.gripper_to_object for each in grasps])
    return pad_contacts(gripper, poses, RayCaster.of_hulls(body.hulls), body.center_of_mass_m)


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
