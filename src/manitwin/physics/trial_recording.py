"""Recording of a grasp trial for replay: the poses of hand and object after each advance of the protocol."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.trial import TrialResult, TrialSettings
from manitwin.physics.trial_phases import Phase, TrialScene, TrialWatch
from manitwin.robots.grippers.gripper import Gripper


@dataclass(frozen=True)
class TrialRecording:
    """States of a trial, from its first step to the deciding one.

    ``time_s (S,)``; ``phases (S,)``, their names; ``hand_m (S, 3)``, displacement of the hand along the axes of the
    object frame at the start; ``object_to_hand (S, 4, 4)``; ``joints (S, J)``: the distances (m) of both pads from the
    plane between them, the joint positions (rad) of a multi-finger hand, or whether the vacuum was on.
    """

    result: TrialResult
    time_s: np.ndarray
    phases: tuple[Phase, ...]
    hand_m: np.ndarray
    object_to_hand: np.ndarray
    joints: np.ndarray


class RecordingTrial(Protocol):
    """Grasp trial of an engine that can be recorded; the same arguments give the same result as ``run``."""

    def record(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> TrialRecording:
        """Try one grasp ``gripper_to_object (4, 4)`` and record it; multi-finger hands need ``joints_rad (2, J)``."""
        ...


class WatchedScene(TrialScene, Protocol):
    """Scene that exposes poses and joints; reading them does not affect the trial."""

    def object_to_hand(self) -> np.ndarray:
        """Return the object's pose ``(4, 4)`` in the hand's frame."""
        ...

    def hand_joints(self) -> np.ndarray:
        """Return the state ``(J,)`` of the hand, as in ``TrialRecording.joints``."""
        ...


class TrialRecorder:
    """Collects the states of a trial; if the trial is restarted, those of the last run."""

    def __init__(self) -> None:
        self._time_s: list[float] = []
        self._phases: list[Phase] = []
        self._rows: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

    def watch(self, scene: WatchedScene) -> TrialWatch:
        """Start a new recording and return the callback for ``run_phases``."""
        self._time_s, self._phases, self._rows = [], [], []

        def look(phase: Phase, time_s: float, hand_m: np.ndarray) -> None:
            self._time_s.append(time_s)
            self._phases.append(phase)
            self._rows.append((hand_m, scene.object_to_hand(), scene.hand_joints()))

        return look

    def recording(self, result: TrialResult, object_to_hand: np.ndarray, joints: np.ndarray) -> TrialRecording:
        """Return the recorded states; if nothing was simulated, the single state given by ``object_to_hand`` and ``joints``."""
        rows = self._rows or [(np.zeros(3), object_to_hand, joints)]
        return TrialRecording(
            result,
            np.array(self._time_s or [0.0]),
            tuple(self._phases) or ("open",),
            np.array([hand_m for hand_m, _, _ in rows]),
            np.array([pose for _, pose, _ in rows]),
            np.array([state for _, _, state in rows]),
        )
