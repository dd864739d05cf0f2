"""JSON document of a grasp trial for the 3D view: poses of hand and object over time."""

from __future__ import annotations

from itertools import groupby
from typing import Any

import numpy as np

from manitwin.geometry.poses import quaternion_wxyz
from manitwin.physics.trial_recording import TrialRecording
from manitwin.pipeline.trial_replay import replay_trial
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.twin.loaded_twin import Twin
from manitwin.web.twin_document import document_bytes

DOCUMENT = "trial.json"
_DECIMALS = 5


def trial_bytes(folder: str, gripper: str, grasp_id: str) -> bytes:
    """Repeat a grasp trial of the twin in a folder and return its document as JSON; raises the errors of ``replay_trial``."""
    return document_bytes(trial_document(Twin(folder), gripper, grasp_id))


def trial_document(twin: Twin, gripper: str, grasp_id: str) -> dict[str, Any]:
    """Repeat a grasp trial and return its document: metres, quaternions wxyz, seconds.

    The frame is the object frame at the beginning of the trial, +Z up. Poses are rows of position and quaternion, one per state,
    or a single row if constant; those of ``boxes`` are in the hand frame.
    """
    replayed = replay_trial(twin, gripper, grasp_id)
    recording, result = replayed.recording, replayed.recording.result
    hand = np.repeat(replayed.gripper_to_object[None], len(recording.time_s), axis=0)
    hand[:, :3, 3] += recording.hand_m
    return {
        "grasp_id": grasp_id,
        "gripper": gripper,
        "engine": replayed.engine,
        "outcome": result.outcome,
        "recorded_outcome": replayed.recorded_outcome,
        "displacement_m": _number(result.displacement_m),
        "finger_forces_n": [_number(force) for force in result.finger_forces_n],
        "time_s": [round(float(time), 4) for time in recording.time_s],
        "phases": phase_spans(recording),
        "hand": pose_rows(hand),
        "object": pose_rows(hand @ recording.object_to_hand),
        "boxes": _boxes(replayed.gripper, recording.joints),
    }


def phase_spans(recording: TrialRecording) -> list[dict[str, Any]]:
    """Return the phases in order, each with the index of its first state."""
    return [
        {"label": phase, "first": next(states)[0]}
        for phase, states in groupby(enumerate(recording.phases), lambda each: each[1])
    ]


def pose_rows(matrices: np.ndarray) -> list[float]:
    """Return poses ``(S, 4, 4)`` as rows of position and quaternion in a flat list; a single row if all are equal
    after rounding.
    """
    rows = np.hstack([matrices[:, :3, 3], quaternion_wxyz(matrices[:, :3, :3])]).round(_DECIMALS) + 0.0
    return [float(each) for each in (rows[:1] if (rows == rows[0]).all() else rows).ravel()]


def _boxes(gripper: Gripper, joints: np.ndarray) -> list[dict[str, Any]]:
    """Return the boxes of a hand and their poses in its frame for each state of its joints ``(S, J)``."""
    placed = [_hand_boxes(gripper, row) for row in joints]
    return [
        {"half": [float(each) for each in half], "poses": pose_rows(np.array([row[place][0] for row in placed]))}
        for place, (_, half) in enumerate(placed[0])
    ]


def _hand_boxes(gripper: Gripper, state: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    if isinstance(gripper, MultiFingerGripper):
        return gripper.boxes_at(state)
    if not isinstance(gripper, ParallelGripper):
        return gripper.boxes(gripper.opening_m)
    plus, minus = (gripper.boxes(2 * float(distance)) for distance in state)  # each finger has its own joint position
    first_of_minus = len(gripper.palm_boxes) + len(gripper.finger_boxes)
    return [*plus[:first_of_minus], *minus[first_of_minus:]]


def _number(value: float) -> float | None:
    return round(float(value), _DECIMALS) if np.isfinite(value) else None
