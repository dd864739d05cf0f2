"""What is dropped before the simulation, and what the simulation is likely to hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.geometry.ray_caster import RayCaster
from manitwin.physics.grasp_selection import Merits, select_likely
from manitwin.physics.hull_surface import union_surface
from manitwin.physics.pad_contact import PadContacts, pad_contacts
from manitwin.robots.grippers.hand_collision import HandCollision
from manitwin.robots.grippers.parallel import ParallelGripper

# The pad filter: two cells of fifteen, contact centres at most 6 mm apart, normals inside the narrowed friction cone.
MIN_CELLS, MAX_OFFSET_M, CONE_SAFETY = 2, 0.006, 1.5
CLEARANCE_M = 0.0005
# What the simulation is likely to hold, measured on 1,799 trials of 18 objects: of grasps with levers under 50 mm 98 %
# held, beyond 80 mm 47 %; of those on 2 cells 73 %, on 6 and more 92 %.
GOOD_CELLS, GOOD_LEVER_M, GOOD_TORQUE_RATIO = 3, 0.05, 0.5
PAD_ARM_M = 0.007  # the arm of the friction torque that a pad can hold: about two thirds of its half width
PEAK_SLIDE_ACCELERATION_M_S2 = 3.6  # of a quintic path of 0.1 m in 0.4 s: 5.77 d / t^2


@dataclass(frozen=True)
class FilteredGrasps:
    """Which of N grasps are left and what their pads meet, and how many were left after the pads alone."""

    index: np.ndarray
    contacts: PadContacts
    after_pad: int


class GraspFilter:
    """The filters of one gripper for one object."""

    def __init__(
        self, gripper: ParallelGripper, hulls: tuple[np.ndarray, ...], center_of_mass_m: np.ndarray, friction: float
    ):
        """Prepare the convex hulls (each ``(V, 3)`` m); ``friction`` is that between finger and object."""
        self._gripper, self._center_of_mass_m = gripper, center_of_mass_m
        self._caster = RayCaster(union_surface(hulls))
        self._collision = HandCollision(hulls)
        self._min_alignment = 1 / np.hypot(1, friction / CONE_SAFETY)

    def __call__(self, gripper_to_object: np.ndarray) -> FilteredGrasps:
        """Keep the grasps ``(N, 4, 4)`` whose pads would touch well and whose open hand is free of the object."""
        contacts = pad_contacts(self._gripper, gripper_to_object, self._caster, self._center_of_mass_m)
        touching = (contacts.width_m < self._gripper.opening_m) & (contacts.cells >= MIN_CELLS)
        facing = (contacts.offset_m <= MAX_OFFSET_M) & (contacts.alignment >= self._min_alignment)
        index = np.flatnonzero(touching & facing)
        overlaps = self._collision.overlaps(
            self._gripper, gripper_to_object[index], opening_m=self._gripper.opening_m, clearance_m=CLEARANCE_M
        )
        left = index[~overlaps]
        return FilteredGrasps(left, contacts.take(left), len(index))


def torque_ratio(lever_m: np.ndarray, *, mass_kg: float, force_n: float, friction: float) -> np.ndarray:
    """Return the torque that weight and slides need about the pads, over what friction can hold."""
    needed = mass_kg * (9.81 + PEAK_SLIDE_ACCELERATION_M_S2) * lever_m
    return needed / (2 * friction * force_n * PAD_ARM_M)


def pad_merits(contacts: PadContacts, torque_ratio: np.ndarray) -> Merits:
    """Rate grasps: fit ones touch with three cells or more and need half of the friction torque at most; levers cost."""
    weak = contacts.cells < GOOD_CELLS
    return Merits(~weak & (torque_ratio <= GOOD_TORQUE_RATIO), weak, contacts.lever_m, GOOD_LEVER_M)


def select_grasps(
    gripper_to_object: np.ndarray, depth_m: np.ndarray, contacts: PadContacts, torque_ratio: np.ndarray, count: int
) -> np.ndarray:
    """Choose ``count`` diverse grasps among those that are likely to hold: indices into the N grasps."""
    return select_likely(gripper_to_object, depth_m, pad_merits(contacts, torque_ratio), count)
