"""A grasp trial as it can be watched again: where hand and object were, whenever the protocol looked at them."""

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
    """The states of a trial, from its first step to the one that decided.

    ``time_s (S,)``; ``phases (S,)`` their names; ``hand_m (S, 3)`` how far the hand was moved, along the axes of the object
    frame at the start; ``object_to_hand (S, 4, 4)``; ``joints (S, J)``: the distances (m) of both pads from the plane between
    them, the joints (rad) of a hand with more of them, or whether the vacuum was on.
    """

    result: TrialResult
    time_s: np.ndarray
    phases: tuple[Phase, ...]
    hand_m: np.ndarray
    object_to_hand: np.ndarray
    joints: np.ndarray


class RecordingTrial(Protocol):
    """An engine's grasp trial that can be recorded; the same arguments give the result of its ``run``."""

    def record(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> TrialRecording:
        """Try one grasp ``gripper_to_object (4, 4)``; ``joints_rad (2, J)`` are given for hands with more joints."""
        ...


class WatchedScene(TrialScene, Protocol):
    """A scene that tells where things are; to ask changes nothing of the trial."""

    def object_to_hand(self) -> np.ndarray:
        """Return the object's pose ``(4, 4)`` in the hand's frame."""
        ...

    def hand_joints(self) -> np.ndarray:
        """Return the state ``(J,)`` of the hand, as ``TrialRecording.joints`` has it."""
        ...


class TrialRecorder:
    """Collects the states of a trial; of one that begins again, those of the last."""

    def __init__(self) -> None:
        self._time_s: list[float] = []
        self._phases: list[Phase] = []
        self._rows: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

    def watch(self, scene: WatchedScene) -> TrialWatch:
        """Begin anew, and return what ``run_phases`` is to call."""
        self._time_s, self._phases, self._rows = [], [], []

        def look(phase: Phase, time_s: float, hand_m: np.ndarray) -> None:
            self._time_s.append(time_s)
            self._phases.append(phase)
            self._rows.append((hand_m, scene.object_to_hand(), scene.hand_joints()))

        return look

    def recording(self, result: TrialResult, object_to_hand: np.ndarray, joints: np.ndarray) -> TrialRecording:
        """Return what was seen; where nothing was simulated, the one state that it would have begun with."""
        rows = self._rows or [(np.zeros(3), object_to_hand, joints)]
        return TrialRecording(
            result,
            np.array(self._time_s or [0.0]),
            tuple(self._phases) or ("open",),
            np.array([hand_m for hand_m, _, _ in rows]),
            np.array([pose for _, pose, _ in rows]),
            np.array([state for _, _, state in rows]),
        )
