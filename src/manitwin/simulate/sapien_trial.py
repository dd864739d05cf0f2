"""The grasp trial of a parallel gripper in SAPIEN 3: two fingers that share one target."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import sapien

from manitwin.geometry.poses import inverse
from manitwin.simulate.gripper import Gripper, of_kind
from manitwin.simulate.hand_reach import largest_motion_m, reachable_hulls, reached_at
from manitwin.simulate.hands.parallel import ParallelGripper
from manitwin.simulate.rigid_body import RigidBody
from manitwin.simulate.sapien_hand import FixedHand
from manitwin.simulate.sapien_scene import HandScene
from manitwin.simulate.trial import TrialResult, TrialSettings
from manitwin.simulate.trial_phases import run_phases

REACH_MARGIN_M = 0.015  # hulls farther than this from the closing hand are left out
# A trial counts only where none of them came this near whenever it was looked: the contact offset of 2 mm, and what the
# object may do between two looks.
LOOK_MARGIN_M = 0.005


class SapienTrial:
    """Try grasps one by one in SAPIEN on the CPU."""

    name = "sapien"

    def run(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> list[TrialResult]:
        """Try the grasps ``gripper_to_object (N, 4, 4)`` and return their results in the same order."""
        hand = of_kind(gripper, ParallelGripper)
        return [_try_one(body, hand, pose, settings) for pose in gripper_to_object]


def _try_one(
    body: RigidBody, gripper: ParallelGripper, gripper_to_object: np.ndarray, settings: TrialSettings
) -> TrialResult:
    """Try a grasp on the hulls that the hand can reach; where the object turned others towards it, on all."""
    reached = reachable_hulls(body.hulls, gripper, gripper_to_object, REACH_MARGIN_M)
    near = tuple(hull for hull, is_near in zip(body.hulls, reached, strict=True) if is_near)
    far = tuple(hull for hull, is_near in zip(body.hulls, reached, strict=True) if not is_near)
    object_to_hand = inverse(gripper_to_object)

    def make_hand(scene: sapien.Scene) -> FixedHand:
        return FixedHand(scene, gripper, settings)

    if not near:
        return TrialResult("misses", 0.0, 0.0, 0.0, (0.0, 0.0), 0)  # nothing to simulate: nothing touches the object
    if far:
        scene = HandScene(replace(body, hulls=near), object_to_hand, settings, make_hand)
        result = run_phases(scene, object_to_hand[:3, :3], settings)
        if _stayed_out(far, gripper, np.array(scene.looks)):
            return result
    return run_phases(HandScene(body, object_to_hand, settings, make_hand), object_to_hand[:3, :3], settings)


def _stayed_out(far: tuple[np.ndarray, ...], gripper: ParallelGripper, looks: np.ndarray) -> bool:
    """Tell whether no hull that was left out came near the hand in any look ``(P, 4, 4)``; the cheap bound goes first."""
    if largest_motion_m(far, looks) < REACH_MARGIN_M - LOOK_MARGIN_M:
        return True
    return not reached_at(far, gripper, looks, LOOK_MARGIN_M).any()
