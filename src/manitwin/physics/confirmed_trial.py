"""Grasp trial confirmed by a second engine: a grasp in which the object moved counts as held only if both engines hold it.

An object that does not move in the hand is held below the friction limit, and engines agree about it. An object that
turned or slid before it came to rest has reached that limit, where the verdict depends on how an engine distributes
pressure over the pads. Measured on 1,337 grasps of 60 objects that one engine held: all grasps that the other engine
dropped were among the 10 % in which the object had moved.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.trial import GraspTrial, TrialResult, TrialSettings
from manitwin.robots.grippers.gripper import Gripper

MOVED_M, MOVED_RAD = 0.002, 0.05
"""Thresholds of visible motion: a fifth of the displacement that the slides allow, and about three degrees."""


class ConfirmedTrial:
    """Grasp trial in a first engine; held grasps in which the object moved are repeated in a second, which can overturn them."""

    def __init__(self, first: GraspTrial, second: GraspTrial):
        """Take both engines. ``name`` is that of the first, ``confirmed_by`` that of the second."""
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
        """Try the grasps ``gripper_to_object (N, 4, 4)`` and return their results in the same order.

        A held grasp that the second engine does not hold gets the second engine's result. ``second_outcome`` is set for
        the grasps that the second engine tried.
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
    """Tell whether the object turned by more than ``MOVED_RAD`` or moved by more than ``MOVED_M`` in the closed hand."""
    return result.displacement_m > MOVED_M or result.rotation_rad > MOVED_RAD
