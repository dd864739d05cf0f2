"""Grasp wrench limits of two parallel pads: the share of their load limit that weight and slide accelerations use.

About the closing axis, the pads resist a moment by torsional friction alone. About the two other axes they resist it by
shifting their centres of pressure to opposite ends of the contact regions, and by friction forces of opposite sign on
both sides of a wide object. A vessel held by its wall, whose weight lies beside the pads along the closing axis, can
therefore tip out of a grasp even if the grasp axis passes close to its centre of mass.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from manitwin.physics.trial import GRAVITY_M_S2
from manitwin.physics.trial_phases import SLIDE_DIRECTIONS

PEAK_SLIDE_ACCELERATION_M_S2 = 3.6  # peak of a quintic path of 0.1 m in 0.4 s: 5.77 d / t^2
PAD_ARM_M = 0.007  # effective radius of the friction torque of a whole pad: about two thirds of its half width
LEAST_MOMENT_NM = 1e-3  # lower bound of the moment limits: pads with a point contact resist almost no moment


@dataclass(frozen=True)
class PressedPads:
    """Pressure regions of two pads in N grasps, in the gripper frame.

    ``middle_m (N, 3)`` is the midpoint of the two contacts, ``width_m (N,)`` their distance along X. ``least_apart_m``
    and ``most_apart_m (N, 2)`` bound, along Y and Z, the offset of the +X pad's centre of pressure from that of the -X
    pad. ``touching (N,)`` is the share of a pad's area that is in contact, for the pad with less.
    """

    middle_m: np.ndarray
    width_m: np.ndarray
    least_apart_m: np.ndarray
    most_apart_m: np.ndarray
    touching: np.ndarray

    def take(self, index: np.ndarray) -> PressedPads:
        """Return the pressure regions of the grasps at ``index``."""
        return PressedPads(**{f.name: getattr(self, f.name)[index] for f in fields(self)})


def torque_ratio(lever_m: np.ndarray, *, mass_kg: float, force_n: float, friction: float) -> np.ndarray:
    """Return the torque that weight and slides exert about the pads, divided by the torsional friction limit.

    ``lever_m`` is the distance of the centre of mass from the grasp axis. The limit is 2 mu F r with r = ``PAD_ARM_M``.
    """
    needed = mass_kg * (GRAVITY_M_S2 + PEAK_SLIDE_ACCELERATION_M_S2) * lever_m
    return needed / (2 * friction * force_n * PAD_ARM_M)


def load_share(
    pads: PressedPads,
    gripper_to_object: np.ndarray,
    center_of_mass_m: np.ndarray,
    *,
    mass_kg: float,
    force_n: float,
    friction: float,
    flat: bool = True,
) -> np.ndarray:
    """Return the share ``(N,)`` of the pads' load limit that weight and slides use in grasps ``(N, 4, 4)``.

    For each of the six slide directions the share is sqrt(t^2 + mx^2 + my^2 + mz^2): the force across the closing axis over 2
    mu F, and each moment over its own limit; the largest share counts. The limits are 2 mu F r about the closing axis and F d
    + mu F w about the two other axes, with the available offset d of the centres of pressure and the width w. The radius r is
    that of a whole pad if both pads are taken to lie ``flat`` on the object, otherwise that of a disc with the area in
    contact. The ellipsoid approximates the limit surface (Howe and Cutkosky, Practical force-motion models for sliding
    manipulation, 1996).

    ``gripper_to_object`` and ``center_of_mass_m (3,)`` are in the object frame, whose -Z is the direction of gravity.
    """
    rotation = gripper_to_object[:, :3, :3]
    away_m = np.einsum("nji,nj->ni", rotation, center_of_mass_m - gripper_to_object[:, :3, 3]) - pads.middle_m
    accelerations = [0.0, 0.0, -GRAVITY_M_S2] + PEAK_SLIDE_ACCELERATION_M_S2 * SLIDE_DIRECTIONS
    forces_n = mass_kg * np.einsum("nji,kj->nki", rotation, accelerations)
    moments_nm = np.cross(away_m[:, None], forces_n)
    # The +X pad pushes along -X. With its centre of pressure offset by (y, z) from the other's, both give the moment F (0,
    # -z, y).
    sides = np.stack([-moments_nm[:, :, 2], moments_nm[:, :, 1]], axis=2)  # along Y, along Z
    apart_m = np.where(sides > 0, pads.most_apart_m[:, None], -pads.least_apart_m[:, None])
    limits_nm = force_n * apart_m + friction * force_n * pads.width_m[:, None, None]
    arm_m = PAD_ARM_M * np.sqrt(np.ones_like(pads.touching) if flat else pads.touching)
    torque_nm = 2 * friction * force_n * arm_m[:, None, None]
    shares = np.concatenate(
        [
            np.linalg.norm(forces_n[:, :, 1:], axis=2, keepdims=True) / (2 * friction * force_n),
            moments_nm[:, :, :1] / np.maximum(torque_nm, LEAST_MOMENT_NM),
            sides / np.maximum(limits_nm, LEAST_MOMENT_NM),
        ],
        axis=2,
    )
    return np.asarray(np.linalg.norm(shares, axis=2).max(1))


def jams(width_m: np.ndarray, pad_m: float, friction: float) -> np.ndarray:
    """Tell which objects stay on the pads' edges instead of turning flat between pads of length ``pad_m`` that close on them.

    Turned by a small angle t, an object of width w separates pads of length d by w + d t. Turning it by dt gains the
    work F d dt of the closing force F, while friction on two edges that each slide by w/2 dt costs mu F w dt. The
    object jams if w > d / mu.
    """
    return width_m > pad_m / friction
