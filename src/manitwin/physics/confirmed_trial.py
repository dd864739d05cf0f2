"""Two engines for what is at the limit: a grasp in which the object moved counts as held only where both engines hold it.

What stays where it is in the hand is held by less than friction's limit, and engines agree about it. What turned or slid before
it came to rest has reached that limit, where the verdict depends on how an engine spreads pressure over the pads: of 1,337
grasps of 60 objects that one engine held, all that the other one dropped were among the 10 % that had moved.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.trial import GraspTrial, TrialResult, TrialSettings
from manitwin.robots.grippers.gripper import Gripper

MOVED_M, MOVED_RAD = 0.002, 0.05
"""A fifth of what the slides allow, and three degrees."""


class ConfirmedTrial:
    """Try grasps in one engine, and those that it holds though the object moved in a second one; it can overturn them."""

    def __init__(self, first: GraspTrial, second: GraspTrial):
        """Take both engines; the trial is named after the first."""
        self.first, self.second = first, second
        self.name = first.name
        self.confirmed_by = second.name

    def run(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> list[TrialResult]:
        """Try the grasps ``gripper_to_object (N, 4, 4)``; a held one that the second engine refuses has its result.

        What the second engine says of those that it was asked about is their ``second_outcome``.
        """
        results = list(self.first.run(body, gripper, gripper_to_object, settings, joints_rad))
        moved = [number for number, result in enumerate(results) if result.outcome == "held" and has_moved(result)]
        if moved:
            joints = None if joints_rad is None else joints_rad[moved]
            again = self.second.run(body, gripper, gripper_to_object[moved], settings, joints)
            for number, result in zip(moved, again, strict=True):
                said = results[number] if result.outcome == "held" else result
                results[number] = replace(said, second_outcome=result.outcome)
        return results


def has_moved(result: TrialResult) -> bool:
    """Tell whether the object visibly turned in the closed hand, or slid in it."""
    return result.displacement_m > MOVED_M or result.rotation_rad > MOVED_RAD
