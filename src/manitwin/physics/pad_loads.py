"""What weight and slides ask of two pads: the share of the wrench that they bear by friction and by where they press.

About the closing axis pads bear a moment by friction alone. Across it they bear one by pressing with opposite ends, as far apart
as what they touch reaches, and by friction that pulls up on one side and down on the other of what is wide. So a vessel that
hangs by its wall, with its weight beside the pads along the closing axis, may tip out of a grasp whose axis passes near its
centre of mass.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from manitwin.physics.trial import GRAVITY_M_S2
from manitwin.physics.trial_phases import SLIDE_DIRECTIONS

PEAK_SLIDE_ACCELERATION_M_S2 = 3.6  # of a quintic path of 0.1 m in 0.4 s: 5.77 d / t^2
PAD_ARM_M = 0.007  # the arm of the friction torque that a whole pad can hold: about two thirds of its half width
LEAST_MOMENT_NM = 1e-3  # pads that touch in a point bear as good as nothing


@dataclass(frozen=True)
class PressedPads:
    """Where two pads press in N grasps, in the gripper's frame.

    ``middle_m (N, 3)`` is the middle between the two contacts, ``width_m (N,)`` their distance along X. ``least_apart_m`` and
    ``most_apart_m (N, 2)`` say along Y and Z how far the +X pad's centre of pressure can be from the -X pad's.
    ``touching (N,)`` is the share of a pad's area that touches, of the pad with less.
    """

    middle_m: np.ndarray
    width_m: np.ndarray
    least_apart_m: np.ndarray
    most_apart_m: np.ndarray
    touching: np.ndarray

    def take(self, index: np.ndarray) -> PressedPads:
        """Return the pads at ``index``."""
        return PressedPads(**{f.name: getattr(self, f.name)[index] for f in fields(self)})


def torque_ratio(lever_m: np.ndarray, *, mass_kg: float, force_n: float, friction: float) -> np.ndarray:
    """Return the torque that weight and slides need about the pads, over what friction can hold."""
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
    """Return the largest share ``(N,)`` of what the pads of grasps ``(N, 4, 4)`` bear that weight and slides ask of them.

    Of each of the slides' six directions, sqrt(t^2 + mx^2 + my^2 + mz^2): the force across the closing axis over 2 mu F, and
    each moment over its own limit. These are 2 mu F r about the closing axis, and F d + mu F w about the others, with the
    distance d of the centres of pressure that the moment wants and the width w. The arm r is that of a whole pad where both are
    taken to be ``flat`` on the object, else that of a disc of the area that touches. An ellipsoid stands for the limit surface
    (Howe and Cutkosky, Practical force-motion models for sliding manipulation, 1996).
    """
    rotation = gripper_to_object[:, :3, :3]
    away_m = np.einsum("nji,nj->ni", rotation, center_of_mass_m - gripper_to_object[:, :3, 3]) - pads.middle_m
    accelerations = [0.0, 0.0, -GRAVITY_M_S2] + PEAK_SLIDE_ACCELERATION_M_S2 * SLIDE_DIRECTIONS
    forces_n = mass_kg * np.einsum("nji,kj->nki", rotation, accelerations)
    moments_nm = np.cross(away_m[:, None], forces_n)
    # the +X pad pushes along -X: with its centre of pressure (y, z) from the other's, both give the moment F (0, -z, y)
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
    """Tell what does not turn flat between pads of ``pad_m`` that close on it, but stays on their edges.

    Turned by a small t between them it is w + d t wide, with its width w and the pads' d: to turn by dt the closing force F
    gives F d dt, and friction on two edges that slide by w/2 dt each takes mu F w dt. So it jams where w > d / mu.
    """
    return width_m > pad_m / friction
