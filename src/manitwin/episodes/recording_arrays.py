"""Types and shapes of the arrays of a stored recording."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from manitwin.episodes.recording import Recording
from manitwin.episodes.stored_episode import RecordedRobot, StoredEpisode
from manitwin.errors import EpisodesError

_KINDS: dict[str, type] = {
    "phase": np.uint8, "target_on_support": bool, "unplanned_contact": bool, "granules_in_objects": np.int16,
    "active_literal": np.uint8,
}  # fmt: skip
"""All other arrays are float32."""

GRANULES = ("granule_positions_m", "granules_in_objects")
"""Only for episodes with granules."""

LITERAL = "active_literal"
"""Only for goals of several literals."""

_OF_ACTIONS = ("phase", LITERAL)


def is_per_action(name: str) -> bool:
    """Tell whether an array of a recording has a row per action ``(T, ...)`` instead of per state ``(T + 1, ...)``."""
    return name.startswith("action_") or name in _OF_ACTIONS


def checked_recording(episode: StoredEpisode) -> Recording:
    """Return the recording with the file's types: float32, phases uint8, flags bool.

    Raises EpisodesError for inconsistent shapes, non-finite values, or an invalid target.
    """
    recording, name = episode.recording, episode.attempt.episode_id
    steps, things = recording.steps, len(episode.objects)
    if steps == 0 or not 0 <= recording.target < things:
        raise EpisodesError(
            f"episode {name}: {steps} steps, target {recording.target} of {things} objects; record it again"
        )
    arrays: dict[str, Any] = {}
    for entry in fields(Recording):
        if entry.name == "target":
            continue
        if entry.name in (*GRANULES, LITERAL) and getattr(recording, entry.name) is None:
            continue
        array = np.asarray(getattr(recording, entry.name))
        rows = steps if is_per_action(entry.name) else steps + 1
        shape = (rows, *_widths(episode.robot, things, recording).get(entry.name, ()))
        if array.shape != shape:
            raise EpisodesError(
                f"episode {name}: {entry.name} has the shape {array.shape}, not {shape}; record it again"
            )
        kind = _KINDS.get(entry.name, np.float32)
        if kind is np.float32 and not np.isfinite(array).all():
            raise EpisodesError(f"episode {name}: {entry.name} is not finite; record it again")
        arrays[entry.name] = array.astype(kind)
    return Recording(target=recording.target, **arrays)


def _widths(robot: RecordedRobot, things: int, recording: Recording) -> dict[str, tuple[int, ...]]:
    arm, arms = len(robot.arm_joints), robot.arm_count
    positions = recording.granule_positions_m
    return {
        "granule_positions_m": () if positions is None else (*positions.shape[1:2], 3),
        "granules_in_objects": (things,),
        "joint_positions_rad": (arm,),
        "joint_velocities_rad_s": (arm,),
        "tip_position_m": (3 * arms,),
        "tip_quaternion_wxyz": (4 * arms,),
        "object_positions_m": (things, 3),
        "object_quaternions_wxyz": (things, 4),
        "object_linear_velocities_m_s": (things, 3),
        "object_angular_velocities_rad_s": (things, 3),
        "finger_forces_n": (2 * arms,),
        "hand": (len(robot.hand_state),),
        "action_hand": (len(robot.hand_action),),
        "action_joint_positions_rad": (arm,),
        "action_tip_position_m": (3 * arms,),
        "action_tip_quaternion_wxyz": (4 * arms,),
    }
