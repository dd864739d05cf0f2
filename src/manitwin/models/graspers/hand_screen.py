"""What is known of a many-jointed hand's grasps before the trial: whether the open hand is free of the object."""

from __future__ import annotations

import numpy as np

from manitwin.errors import Rejected
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest, Screened
from manitwin.physics.grasp_filters import PEAK_SLIDE_ACCELERATION_M_S2
from manitwin.physics.grasp_selection import Merits
from manitwin.physics.trial import GRAVITY_M_S2
from manitwin.robots.grippers.gripper import of_kind
from manitwin.robots.grippers.hand_clearance import HandCollision
from manitwin.robots.grippers.multi_finger import MultiFingerGripper

CLEARANCE_M = 0.0005
# The arm at which friction under the closing force would just carry weight and slides. Of 600 grasps of six objects 93 % held
# where it is under 10 mm, 62 % to 20 mm, 42 % beyond.
GOOD_ARM_M, WEAK_ARM_M = 0.010, 0.020


class HandScreen:
    """Keep grasps whose open hand is free of the object."""

    def __init__(self, request: GraspRequest):
        self._request, self._hand = request, of_kind(request.gripper, MultiFingerGripper)
        self._collision = HandCollision(request.hulls)

    def __call__(self, raw: GraspProposals) -> Screened:
        """Keep the proposals that are free; they cost the arm that friction needs about the contacts."""
        free = ~self._overlaps(raw)
        left = raw.take(np.flatnonzero(free))
        friction = (self._hand.finger_friction + self._request.object_friction) / 2
        needed_nm = self._request.mass_kg * (GRAVITY_M_S2 + PEAK_SLIDE_ACCELERATION_M_S2) * self._lever_m(left)
        arm_m = needed_nm / (friction * self._hand.force_n)
        weak = arm_m > WEAK_ARM_M
        return Screened(left, Merits(~weak, weak, arm_m, GOOD_ARM_M), {"raw": len(raw), "after_collision": len(left)})

    def _lever_m(self, grasps: GraspProposals) -> np.ndarray:
        """Return the distance ``(N,)`` of the centre of mass from the line between the contacts."""
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
        """Say how many were left after each filter."""
        stages = ", ".join(f"{name} {count}" for name, count in counts.items())
        if not counts["raw"]:
            opening = f"{1000 * self._hand.opening_m:.0f} mm between thumb and fingers"
            return Rejected("too_wide", f"no two opposite surface points fit into {opening}")
        return Rejected("no_proposal", f"the open hand overlaps the object in every grasp ({stages})")
