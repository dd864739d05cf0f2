"""What is known of a parallel gripper's grasps before the trial: what the pads meet, and the torque that they must hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manitwin.errors import Rejected
from manitwin.geometry.antipodal import antipodal_pairs
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import sample_surface
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest, Screened
from manitwin.physics.grasp_filters import GraspFilter, pad_merits, torque_ratio
from manitwin.robots.grippers.gripper import of_kind
from manitwin.robots.grippers.parallel import ParallelGripper

MIN_WIDTH_M = 0.0005  # thinner than this, a wall is not told from the surface's noise
WIDTH_SAMPLES = 2000


class PadScreen:
    """Keep grasps whose pads touch well and whose open hand is free of the object."""

    def __init__(self, request: GraspRequest):
        self._request, self._gripper = request, of_kind(request.gripper, ParallelGripper)
        # the mean, as PhysX combines materials
        self._friction = (self._gripper.finger_friction + request.object_friction) / 2
        self._passes = GraspFilter(self._gripper, request.hulls, request.center_of_mass_m, self._friction)

    def __call__(self, raw: GraspProposals) -> Screened:
        """Keep the proposals that pass, with the widths at the pads."""
        left = self._passes(raw.gripper_to_object)
        proposals = replace(raw.take(left.index), width_m=left.contacts.width_m)
        ratio = torque_ratio(
            left.contacts.lever_m,
            mass_kg=self._request.mass_kg,
            force_n=self._gripper.force_n,
            friction=self._friction,
        )
        counts = {"raw": len(raw), "after_pad": left.after_pad, "after_collision": len(proposals)}
        return Screened(proposals, pad_merits(left.contacts, ratio), counts)

    def why_none(self, counts: dict[str, int]) -> Rejected:
        """Say why nothing is left, with the widths that were measured."""
        request, opening_m = self._request, self._gripper.opening_m
        rng = np.random.default_rng(request.seed)
        points, normals, _ = sample_surface(request.solid, WIDTH_SAMPLES, rng)
        caster, anything = RayCaster(request.solid), float(np.linalg.norm(request.solid.extents))
        pairs = antipodal_pairs(caster, points, normals, friction=self._friction, max_width_m=anything, rng=rng)
        if not len(pairs):
            return Rejected("no_proposal", "no two opposite surface points can be pressed together")
        least = pairs.width_m.min()
        if least >= opening_m:
            gripper = f"the {self._gripper.name} opens {opening_m * 1000:.0f} mm"
            return Rejected("too_wide", f"narrowest grip is {least * 1000:.1f} mm, {gripper}")
        most = pairs.width_m[pairs.width_m < opening_m].max()
        if most < MIN_WIDTH_M:
            thick = f"thickest part that fits the stroke is {most * 1000:.2f} mm"
            return Rejected("too_thin", f"{thick}, thinner than the {MIN_WIDTH_M * 1000:.1f} mm that a grip needs")
        stages = ", ".join(f"{name} {count}" for name, count in counts.items())
        grips = f"grips are {least * 1000:.1f} mm wide and more"
        return Rejected("no_proposal", f"no grasp passes the filters ({stages}); {grips}")
