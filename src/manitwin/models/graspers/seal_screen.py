"""What is known of a suction cup's grasps before the trial: whether they seal, and how much of its limits the lip needs."""

from __future__ import annotations

import numpy as np

from manitwin.errors import Rejected
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest, Screened
from manitwin.physics.grasp_filters import PEAK_SLIDE_ACCELERATION_M_S2
from manitwin.physics.grasp_selection import Merits
from manitwin.physics.suction import lip_load, seal
from manitwin.physics.trial import GRAVITY_M_S2
from manitwin.physics.trial_phases import SLIDE_DIRECTIONS
from manitwin.robots.grippers.gripper import of_kind
from manitwin.robots.grippers.hand_clearance import HandCollision
from manitwin.robots.grippers.suction import SuctionGripper

CLEARANCE_M = 0.0005
GOOD_LOAD = 0.5  # half of the limits: what is left over is for what the twin does not know


class SealScreen:
    """Keep grasps that seal and whose gripper is free of the object."""

    def __init__(self, request: GraspRequest):
        self._request, self._gripper = request, of_kind(request.gripper, SuctionGripper)
        self._friction = (self._gripper.finger_friction + request.object_friction) / 2
        self._surface, self._collision = RayCaster(request.solid), HandCollision(request.hulls)

    def __call__(self, raw: GraspProposals) -> Screened:
        """Keep the proposals that seal; they cost what they need of the lip's limits."""
        found = seal(self._gripper, raw.gripper_to_object, self._surface)
        sealed = np.flatnonzero(found.sealed)
        overlaps = self._collision.overlaps(
            self._gripper, raw.gripper_to_object[sealed], opening_m=self._gripper.opening_m, clearance_m=CLEARANCE_M
        )
        left = sealed[~overlaps]
        load = self._load(found.center_m[left], found.inward[left])
        counts = {"raw": len(raw), "after_seal": len(sealed), "after_collision": len(left)}
        return Screened(raw.take(left), Merits(load <= 1, load > 1, load, GOOD_LOAD), counts)

    def _load(self, center_m: np.ndarray, inward: np.ndarray) -> np.ndarray:
        """Return the largest share ``(N,)`` of the lip's limits that weight and slides need."""
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
        """Say how many were left after each filter."""
        stages = ", ".join(f"{name} {count}" for name, count in counts.items())
        across = f"{2000 * self._gripper.lip_radius_m:.0f} mm"
        return Rejected("no_proposal", f"nowhere does a lip of {across} seal free of collision ({stages})")
