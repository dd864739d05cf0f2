"""Screens for each kind of gripper: filter proposals before physics trials, rate them, and explain why none is left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manitwin.errors import Rejected
from manitwin.geometry.antipodal import antipodal_pairs
from manitwin.geometry.sampling import sample_surface
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest, ScreenedProposals
from manitwin.physics.grasp_filters import GraspFilter, pad_merits
from manitwin.physics.grasp_selection import Merits
from manitwin.physics.pad_loads import PEAK_SLIDE_ACCELERATION_M_S2, PressedPads, jams, load_share
from manitwin.physics.suction import lip_load, seal
from manitwin.physics.trial import GRAVITY_M_S2
from manitwin.physics.trial_phases import SLIDE_DIRECTIONS
from manitwin.robots.grippers.gripper import require_kind
from manitwin.robots.grippers.hand_clearance import HandCollision
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.grippers.suction import SuctionGripper

MIN_WIDTH_M = 0.0005  # thinner walls cannot be told from noise of the surface
WIDTH_SAMPLES = 2000
CLEARANCE_M = 0.0005
MOSTLY = 0.8  # share of the pairs with flat pads that must exceed the opening for the object to count as too wide
SQUARE = 0.98  # cosine of normal and closing axis for pads that lie flat
# load limit relative to whole pads, for grasps in which only parts of the pads touch and do not bear the load
MOST_JAMMED_SHARE = 0.75
GOOD_LOAD = 0.5  # half of the limit; the margin covers unknown properties of the object
# Lever arm at which friction under the closing force would just bear weight and slides. Of 600 grasps of six objects, 93 % held
# with an arm under 10 mm, 62 % up to 20 mm, 42 % beyond.
GOOD_ARM_M, WEAK_ARM_M = 0.010, 0.020


class PadScreen:
    """Screen for parallel grippers: the pads touch well and bear the load, and the open gripper is free of collisions."""

    def __init__(self, request: GraspRequest):
        self._request, self._gripper = request, require_kind(request.gripper, ParallelGripper)
        # PhysX combines the friction of two materials by their mean
        self._friction = (self._gripper.finger_friction + request.object_friction) / 2
        self._passes = GraspFilter(self._gripper, request.hulls, request.center_of_mass_m, self._friction)

    def __call__(self, raw: GraspProposals) -> ScreenedProposals:
        """Return the proposals that pass, with the widths measured at the pads."""
        left = self._passes(raw.gripper_to_object)
        proposals = replace(raw.take(left.index), width_m=left.contacts.width_m)
        contacts, poses = left.contacts, proposals.gripper_to_object
        share, share_before_turning = self._load(contacts.pads, poses), self._load(contacts.unturned, poses, flat=False)
        stays_askew = jams(contacts.width_m, 2 * min(self._gripper.pad_half_extents_m), self._friction)
        jammed = stays_askew & (share_before_turning > 1)
        borne = np.flatnonzero(~(jammed & (share > MOST_JAMMED_SHARE)))
        counts = {
            "raw": len(raw),
            "after_pad": left.after_pad,
            "after_collision": len(proposals),
            "after_load": len(borne),
        }
        merits = pad_merits(contacts.take(borne), share[borne], jammed[borne])
        return ScreenedProposals(proposals.take(borne), merits, counts)

    def _load(self, pads: PressedPads, gripper_to_object: np.ndarray, *, flat: bool = True) -> np.ndarray:
        """Return the load ratio ``(N,)`` of grasps ``(N, 4, 4)``: required over available pad wrench.

        It is the maximum over the weight and the slides of the trial.
        """
        return load_share(
            pads,
            gripper_to_object,
            center_of_mass_m=self._request.center_of_mass_m,
            mass_kg=self._request.mass_kg,
            force_n=self._gripper.force_n,
            friction=self._friction,
            flat=flat,
        )

    def why_none(self, counts: dict[str, int]) -> Rejected:
        """Return the rejection, with measured widths of the object."""
        request, opening_m = self._request, self._gripper.opening_m
        rng = np.random.default_rng(request.seed)
        points, normals, _ = sample_surface(request.solid, WIDTH_SAMPLES, rng)
        caster, anything = request.surface, float(np.linalg.norm(request.solid.extents))
        pairs = antipodal_pairs(caster, points, normals, friction=self._friction, max_width_m=anything, rng=rng)
        if not len(pairs):
            return Rejected("no_proposal", "the fingers cannot press on any two opposite surface points")
        square = pairs.take(np.flatnonzero(pairs.alignment >= SQUARE))
        # slanted pairs across an edge or a ball can be arbitrarily close; if no pads touch well, such pairs are no grasps
        least = (square if len(square) and not counts.get("after_collision") else pairs).width_m.min()
        gripper = f"the {self._gripper.name} opens {opening_m * 1000:.0f} mm"
        room_m = opening_m - 2 * CLEARANCE_M
        if least > room_m:
            nearly = f", of which {CLEARANCE_M * 1000:g} mm beside each pad stay free" if least < opening_m else ""
            return Rejected("too_wide", f"narrowest grip is {least * 1000:.1f} mm, {gripper}{nearly}")
        wide = square.width_m[square.width_m > room_m]
        if len(wide) > MOSTLY * len(square) and not counts.get("after_collision"):
            narrower = f"no hand reaches the {least * 1000:.1f} mm and more of a rim or edge"
            return Rejected("too_wide", f"it is at least {wide.min() * 1000:.1f} mm wide, {gripper}, and {narrower}")
        most = pairs.width_m[pairs.width_m < opening_m].max()
        if most < MIN_WIDTH_M:
            thick = f"thickest part that fits the stroke is {most * 1000:.2f} mm"
            return Rejected("too_thin", f"{thick}, thinner than the {MIN_WIDTH_M * 1000:.1f} mm that a grip needs")
        stages = ", ".join(f"{name} {count}" for name, count in counts.items())
        if counts.get("after_collision") and not counts.get("after_load"):
            heavy = f"at {request.mass_kg:.2g} kg friction holds it in none of the grasps, where the pads touch it"
            return Rejected("no_proposal", f"{heavy} ({stages}); check the mass and the size")
        grips = f"grips are {least * 1000:.1f} mm wide and more"
        return Rejected("no_proposal", f"no grasp passes the filters ({stages}); {grips}")


class SealScreen:
    """Screen for suction cups: the lip seals, and the gripper does not collide with the object."""

    def __init__(self, request: GraspRequest):
        self._request, self._gripper = request, require_kind(request.gripper, SuctionGripper)
        self._friction = (self._gripper.finger_friction + request.object_friction) / 2
        self._surface, self._collision = request.surface, HandCollision(request.hulls)

    def __call__(self, raw: GraspProposals) -> ScreenedProposals:
        """Return the proposals that seal; their cost is the load relative to the lip's limits."""
        found = seal(self._gripper, raw.gripper_to_object, self._surface)
        sealed = np.flatnonzero(found.sealed)
        overlaps = self._collision.overlaps(
            self._gripper, raw.gripper_to_object[sealed], opening_m=self._gripper.opening_m, clearance_m=CLEARANCE_M
        )
        left = sealed[~overlaps]
        load = self._load(found.center_m[left], found.inward[left])
        counts = {"raw": len(raw), "after_seal": len(sealed), "after_collision": len(left)}
        return ScreenedProposals(raw.take(left), Merits(load <= 1, load > 1, load, GOOD_LOAD), counts)

    def _load(self, center_m: np.ndarray, inward: np.ndarray) -> np.ndarray:
        """Return the load ratio ``(N,)``: the maximum over weight and slides of the required share of the lip's limits."""
        gravity = np.array([0.0, 0.0, -GRAVITY_M_S2])
        accelerations = gravity + PEAK_SLIDE_ACCELERATION_M_S2 * SLIDE_DIRECTIONS
        arm_m = self._request.center_of_mass_m - center_m
        return lip_load(
            self._request.mass_kg * accelerations[None],
            arm_m[:, None],
            inward[:, None],
            vacuum_force_n=self._gripper.force_n,
            friction=self._friction,
            lip_radius_m=self._gripper.lip_radius_m,
        ).max(1)

    def why_none(self, counts: dict[str, int]) -> Rejected:
        """Return the rejection with the number of proposals left after each filter."""
        stages = ", ".join(f"{name} {count}" for name, count in counts.items())
        across = f"{2000 * self._gripper.lip_radius_m:.0f} mm"
        return Rejected("no_proposal", f"nowhere does a lip of {across} seal free of collision ({stages})")


class HandScreen:
    """Screen for multi-finger hands: the open hand does not collide with the object."""

    def __init__(self, request: GraspRequest):
        self._request, self._hand = request, require_kind(request.gripper, MultiFingerGripper)
        self._collision = HandCollision(request.hulls)

    def __call__(self, raw: GraspProposals) -> ScreenedProposals:
        """Return the collision-free proposals; their cost is the lever arm that friction needs to bear weight and slides."""
        free = ~self._overlaps(raw)
        left = raw.take(np.flatnonzero(free))
        friction = (self._hand.finger_friction + self._request.object_friction) / 2
        needed_nm = self._request.mass_kg * (GRAVITY_M_S2 + PEAK_SLIDE_ACCELERATION_M_S2) * self._lever_m(left)
        arm_m = needed_nm / (friction * self._hand.force_n)
        weak = arm_m > WEAK_ARM_M
        return ScreenedProposals(
            left, Merits(~weak, weak, arm_m, GOOD_ARM_M), {"raw": len(raw), "after_collision": len(left)}
        )

    def _lever_m(self, grasps: GraspProposals) -> np.ndarray:
        """Return the distance ``(N,)`` of the centre of mass from the segment between the contacts."""
        rotation, origin = grasps.gripper_to_object[:, :3, :3], grasps.gripper_to_object[:, :3, 3]
        offset = self._request.center_of_mass_m - origin - grasps.depth_m[:, None] * rotation[:, :, 2]
        along = (offset * rotation[:, :, 0]).sum(1)
        beyond = np.maximum(0.0, np.abs(along) - grasps.width_m / 2)
        return np.hypot(np.linalg.norm(np.cross(offset, rotation[:, :, 0]), axis=1), beyond)

    def _overlaps(self, raw: GraspProposals) -> np.ndarray:
        if raw.joints_rad is None:
            raise AssertionError(f"a proposal for {self._hand.name} has joints")
        result = np.zeros(len(raw), bool)
        opened, which = np.unique(raw.joints_rad[:, 0], axis=0, return_inverse=True)
        for number, joints_rad in enumerate(opened):
            index = np.flatnonzero(which.ravel() == number)
            boxes = self._hand.boxes_at(joints_rad)
            result[index] = self._collision.boxes_overlap(boxes, raw.gripper_to_object[index], CLEARANCE_M)
        return result

    def why_none(self, counts: dict[str, int]) -> Rejected:
        """Return the rejection with the number of proposals left after each filter."""
        stages = ", ".join(f"{name} {count}" for name, count in counts.items())
        if not counts["raw"]:
            opening = f"{1000 * self._hand.opening_m:.0f} mm between thumb and fingers"
            return Rejected("too_wide", f"no two opposite surface points fit between the fingers: {opening}")
        return Rejected("no_proposal", f"the open hand overlaps the object in every grasp ({stages})")
