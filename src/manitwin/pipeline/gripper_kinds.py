"""What each kind of gripper brings to the pipeline: who proposes and screens, where it is tried, what failures say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from manitwin.config import BuildConfig
from manitwin.geometry.rigid_body import RigidBody
from manitwin.models.graspers.hand_screen import HandScreen
from manitwin.models.graspers.pad_screen import PadScreen
from manitwin.models.graspers.protocol import GraspRequest, Screen
from manitwin.models.graspers.seal_screen import SealScreen
from manitwin.physics.trial import TrialResult, TrialSettings
from manitwin.pipeline.why_none import outcomes_of, why_none_held

WhyNoneHeld = Callable[[list[TrialResult], np.ndarray, np.ndarray, RigidBody, TrialSettings], str]
"""From the results, the grasps ``(N, 4, 4)`` and their depths, the object and the settings: one line."""


@dataclass(frozen=True)
class GripperKind:
    """One kind: names are those of the registry.

    ``second_simulator`` is None where no other engine could tell anything new, as a closed form has one answer, or where
    no other engine has such a hand.
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
