"""Ranking of grasps by the torque with which the target's weight rotates it in the jaws during the lift."""

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

LEAST_APART_M = 0.04  # distance between the pads of two hands on one object
EDGE_M = 0.002  # contact closer than this to the pads' ends is by their last row of cells alone
LIFT_ACCELERATION_M_S2 = 2.0  # of 30 planned lifts in layouts: 1.1 in the median and 1.9 at most
LIFTED_WEIGHT = 1 + LIFT_ACCELERATION_M_S2 / GRAVITY_M_S2
"""Load on the jaws during a lift, as a multiple of the object's weight."""
# of a pad's rays: with a smaller contact, fewer of the verified grasps hold (``physics.grasp_filters``)
BROAD_SHARE = 0.4


def stable_grasp_tiers(grasps: Sequence[Grasp], target: PlacedObject, gripper: Gripper) -> list[tuple[Grasp, ...]]:
    """Return grasps in two tiers, each in order: those that carry the target during the lift, and doubtful ones.

    Doubtful grasps carry it if the pads lie flat on it, estimated as a disc with the area in contact. Grasps in which the
    lifted target would rotate about the closing axis are omitted; the grasp trial does not reveal this, because an object
    held at its end also counts as held. Empty tiers are omitted. For grippers other than jaws there is a single tier.
    """
    if not isinstance(gripper, ParallelGripper):
        return [tuple(grasps)] if grasps else []
    torques_nm = [LIFTED_WEIGHT * weight_torque_nm(each, target, gripper) for each in grasps]
    line_nm, face_nm = torsion_limits_nm(gripper)
    both = list(zip(grasps, torques_nm, strict=True))
    on_faces = [(each, nm) for each, nm in both if line_nm < nm <= face_nm]
    shares = contact_shares([each for each, _ in on_faces], target.body, gripper)
    tiers = (
        tuple(each for each, nm in both if nm <= line_nm),
        tuple(
            each for (each, nm), share in zip(on_faces, shares, strict=True) if nm <= face_nm * float(np.sqrt(share))
        ),
    )
    return [tier for tier in tiers if tier]


def stable_along_path(
    grasps: Sequence[Grasp], body: RigidBody, ways: Sequence[np.ndarray], gripper: Gripper
) -> list[Grasp]:
    """Return the grasps in which a body's weight does not rotate it along a path; those that need only a line contact first.

    ``ways`` are alternatives, each poses ``(K, 4, 4)`` of the body in the world; for each grasp the one with the smallest
    load counts. A face contact carries as much as a disc with the area in contact. A standing jug hangs straight below jaws
    at its rim, and loads them with its whole height as a lever when it is tilted to pour. For grippers other than jaws all
    grasps are returned.
    """
    if not isinstance(gripper, ParallelGripper) or not grasps or not ways:
        return list(grasps)
    (line_nm, face_nm), tip_m = torsion_limits_nm(gripper), np.array([[0.0, 0, gripper.tip_depth_m]])
    on_lines, on_faces = list[Grasp](), list[Grasp]()
    for grasp, share in zip(grasps, contact_shares(grasps, body, gripper), strict=True):
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
    """Tell whether a target does not rotate in the jaws during the lift; True for grippers other than jaws."""
    if not isinstance(gripper, ParallelGripper):
        return True
    return LIFTED_WEIGHT * weight_torque_nm(grasp, target, gripper) <= torsion_limits_nm(gripper)[0]


def any_orientation_loads(grasps: Sequence[Grasp], body: RigidBody, gripper: Gripper) -> list[int | None]:
    """Return how the weight loads each grasp if the object may have any orientation; smaller is better, None: not carried.

    The load is the largest torque of the weight about the closing axis, in tenths of what two pads carry with a line contact,
    divided by the share of the pads in contact. The torque limit is that of a line contact if the pads touch narrowly,
    otherwise that of a face. Contact by a corner of a pad does not carry: no more cells than a grasp needs, within 2 mm of
    the pad's end, which fingers miss by small errors. Returns 0 for grippers other than jaws. Measured on 270 lifts: a lift
    in which the object rotated by more than 10 degrees has a larger load than one in which it did not in 79 of 100 pairs, and
    a larger torque in 72.
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
    """Return the distances ``(N,)`` of a grasp's pad centre from those of other grasps."""
    tip_m = np.array([[0.0, 0, gripper.tip_depth_m]])
    tips = np.array([transform_points(each.gripper_to_object, tip_m)[0] for each in (grasp, *others)])
    return np.asarray(np.linalg.norm(tips[1:] - tips[0], axis=1))


def has_narrow_contact(grasps: Sequence[Grasp], body: RigidBody, gripper: Gripper) -> list[bool]:
    """Tell for each grasp whether a pad has less than two fifths of its area in contact, so that the object may rotate.

    Measured on 270 lifts of 48 objects: in 26 of the 158 such grasps the object rotated by more than 10 degrees, and in 3 of
    the 112 others. False for grippers other than jaws.
    """
    if not isinstance(gripper, ParallelGripper):
        return [False] * len(grasps)
    return [share < BROAD_SHARE for share in contact_shares(grasps, body, gripper)]


def contact_shares(grasps: Sequence[Grasp], body: RigidBody, gripper: ParallelGripper) -> list[float]:
    """Return the share of a pad's area in contact for each grasp, of the pad with less."""
    return [int(cells) / PAD_CELLS for cells in _contacts(grasps, body, gripper).cells] if grasps else []


def _contacts(grasps: Sequence[Grasp], body: RigidBody, gripper: ParallelGripper) -> PadContacts:
    """Return the pad contacts of the grasps."""
    poses = np.array([each.gripper_to_object for each in grasps])
    return pad_contacts(gripper, poses, RayCaster.of_hulls(body.hulls), body.center_of_mass_m)


def torsion_limits_nm(gripper: ParallelGripper) -> tuple[float, float]:
    """Return the torque about the closing axis that two pads carry by friction, with a line contact and with a face contact.

    Pressure is uniform. For a line across the pad, as on a bottle, 2 * mu F l / 4 with its shorter side l; for a face 2 * 2/3
    mu F r with the radius of a disc of its area: the limit surface of Howe and Cutkosky, Practical force-motion models for
    sliding manipulation, 1996.
    """
    across_m, along_m = gripper.pad_half_extents_m
    friction_n = gripper.finger_friction * gripper.force_n
    radius_m = float(np.sqrt(4 * across_m * along_m / np.pi))
    return friction_n * min(across_m, along_m), 2 * (2 / 3) * friction_n * radius_m


def weight_torque_nm(grasp: Grasp, target: PlacedObject, gripper: Gripper) -> float:
    """Return the torque (N m) of a target's weight at its current pose about the closing axis through the pads."""
    hand = target.object_to_world @ grasp.gripper_to_object
    tip = transform_points(hand, np.array([[0.0, 0, gripper.tip_depth_m]]))[0]
    center = transform_points(target.object_to_world, target.body.center_of_mass_m[None])[0]
    weight_n = np.array([0.0, 0, -GRAVITY_M_S2 * target.body.mass_kg])
    return abs(float(np.cross(center - tip, weight_n) @ hand[:3, 0]))
