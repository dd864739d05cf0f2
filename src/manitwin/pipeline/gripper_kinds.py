"""Strategies per kind of gripper: proposal, screening, simulator, and the explanation if no grasp held."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from manitwin.config import BuildConfig
from manitwin.geometry.grasp_diversity import fingertips
from manitwin.geometry.rigid_body import RigidBody
from manitwin.models.graspers.protocol import GraspRequest, Screen
from manitwin.models.graspers.screens import HandScreen, PadScreen, SealScreen
from manitwin.physics.pad_loads import PEAK_SLIDE_ACCELERATION_M_S2, torque_ratio
from manitwin.physics.trial import GRAVITY_M_S2, TrialResult, TrialSettings


def why_none_held(
    results: list[TrialResult],
    gripper_to_object: np.ndarray,
    depth_m: np.ndarray,
    body: RigidBody,
    settings: TrialSettings,
) -> str:
    """Describe the outcomes, and whether friction is too low for the weight or the centre of mass is out of reach."""
    friction = (settings.finger_friction + body.friction_static) / 2
    needed_n = body.mass_kg * (GRAVITY_M_S2 + PEAK_SLIDE_ACCELERATION_M_S2)
    carried_n = 2 * friction * settings.force_n
    reasons = []
    if needed_n > carried_n:
        reasons.append(
            f"too slippery for its weight: friction carries {carried_n:.1f} N, lift and slides need {needed_n:.1f} N"
        )
    if len(results):
        lever_m = nearest_lever_m(gripper_to_object, depth_m, body.center_of_mass_m)
        ratio = float(
            torque_ratio(np.array([lever_m]), mass_kg=body.mass_kg, force_n=settings.force_n, friction=friction)[0]
        )
        if ratio > 1:
            reasons.append(
                f"centre of mass out of reach: {1000 * lever_m:.0f} mm from the nearest grip, whose pads carry "
                f"{1 / ratio:.2f} of the torque"
            )
    return "; ".join([outcomes_of(results), *reasons])


def outcomes_of(results: list[TrialResult]) -> str:
    """Describe how often each outcome occurred."""
    failures = Counter(result.outcome for result in results)
    counted = ", ".join(f"{count} {outcome}" for outcome, count in sorted(failures.items()))
    return f"none of {len(results)} simulated grasps held: {counted}"


def nearest_lever_m(gripper_to_object: np.ndarray, depth_m: np.ndarray, center_of_mass_m: np.ndarray) -> float:
    """Return the least distance (m) of the centre of mass from the closing axes of grasps ``(N, 4, 4)``."""
    arms = center_of_mass_m - fingertips(gripper_to_object, depth_m)
    return float(np.linalg.norm(np.cross(arms, gripper_to_object[:, :3, 0]), axis=1).min())


WhyNoneHeld = Callable[[list[TrialResult], np.ndarray, np.ndarray, RigidBody, TrialSettings], str]
"""Returns a one-line explanation from the results, the grasps ``(N, 4, 4)`` and their depths, the body and the settings."""


@dataclass(frozen=True)
class GripperKind:
    """The strategies of one kind of gripper; backend names are those of the registry.

    ``second_simulator`` is None if no other engine adds information, as a closed form has one answer, or if no other engine
    supports such a hand.
    """

    screen: Callable[[GraspRequest], Screen]
    grasper: Callable[[BuildConfig], str]
    simulator: Callable[[BuildConfig], str]
    second_simulator: Callable[[BuildConfig], str | None]
    why_none_held: WhyNoneHeld


KINDS: dict[str, GripperKind] = {
    "parallel": GripperKind(
        screen=PadScreen,
        grasper=lambda config: config.grasper,
        simulator=lambda config: config.simulator,
        second_simulator=lambda config: config.second_simulator,
        why_none_held=why_none_held,
    ),
    "suction": GripperKind(
        screen=SealScreen,
        grasper=lambda config: "suction",
        simulator=lambda config: "statics",
        second_simulator=lambda config: None,
        why_none_held=lambda results, *others: outcomes_of(results),
    ),
    "multi_finger": GripperKind(
        screen=HandScreen,
        grasper=lambda config: "postures",
        simulator=lambda config: "sapien_articulation",
        second_simulator=lambda config: None,
        why_none_held=lambda results, *others: outcomes_of(results),
    ),
}
