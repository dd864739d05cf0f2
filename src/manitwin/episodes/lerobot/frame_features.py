"""Features of a frame: their table for a robot, and an episode's frames as arrays."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from manitwin.episodes.handled_objects import handled_objects
from manitwin.episodes.lerobot.lerobot_format import DEFAULT_FEATURES
from manitwin.episodes.recording import Recording, joint_delta, tip_delta, tip_poses
from manitwin.episodes.stored_episode import RecordedRobot, StoredEpisode

GRANULES = "observation.granules"
_POSE = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
_TWIST = ("dx_m", "dy_m", "dz_m", "rx_rad", "ry_rad", "rz_rad")


@dataclass(frozen=True)
class Feature:
    """A LeRobot feature; ``names`` of its components, None for a scalar."""

    name: str
    dtype: str
    names: tuple[str, ...] | None = None

    @property
    def width(self) -> int:
        """Number of values per frame."""
        return 1 if self.names is None else len(self.names)

    @property
    def info(self) -> dict[str, Any]:
        """Entry of info.json."""
        return {"dtype": self.dtype, "shape": [self.width], "names": None if self.names is None else list(self.names)}

    @property
    def arrow(self) -> pa.DataType:
        """Arrow type of the column."""
        value = pa.bool_() if self.dtype == "bool" else pa.type_for_alias(self.dtype)
        return value if self.names is None else pa.list_(value, self.width)


def features_of(robot: RecordedRobot, *, granules: bool = False) -> tuple[Feature, ...]:
    """Return the features of a robot's episodes in column order, optionally with ``granules`` counts."""
    joints, told = robot.arm_joints, robot.hand_action
    prefixes = [f"{arm.name}_" for arm in robot.arms] or [""]
    tips, twists = ([f"{prefix}{name}" for prefix in prefixes for name in names] for names in (_POSE, _TWIST))
    return (
        Feature("observation.state", "float32", (*joints, *robot.hand_state)),
        Feature("observation.velocity", "float32", joints),
        Feature("observation.tip_pose", "float32", tuple(tips)),
        Feature("observation.target_pose", "float32", _POSE),
        *([Feature(GRANULES, "int64", ("in_target", "in_others", "in_none"))] if granules else []),
        Feature("action", "float32", (*joints, *told)),
        Feature("action.joint_delta", "float32", (*joints, *told)),
        Feature("action.tip_delta", "float32", (*twists, *told)),
        Feature("next.success", "bool"),
        Feature("next.done", "bool"),
        Feature("phase", "int64"),
        Feature("active_literal", "int64"),
        *(Feature(name, dtype) for name, dtype in DEFAULT_FEATURES.items()),
    )


def frames_of(
    episode: StoredEpisode, episode_index: int, first_index: int, task_index: int, rate_hz: int
) -> dict[str, np.ndarray]:
    """Return the features of an episode with ``rate_hz`` states per second as arrays ``(T, width)``, scalars ``(T,)``.

    Frame t is state t and the action given in it; the state after the last action has no frame.
    """
    recording = episode.recording
    steps, now = recording.steps, slice(0, recording.steps)
    number, last = np.arange(steps), np.arange(steps) == recording.steps - 1
    state = np.hstack([recording.joint_positions_rad, recording.hand])
    handled = handled_objects(episode)[now]
    poses = [recording.object_positions_m[number, handled], recording.object_quaternions_wxyz[number, handled]]
    return {
        "observation.state": state[now],
        "observation.velocity": recording.joint_velocities_rad_s[now],
        "observation.tip_pose": tip_poses(recording.tip_position_m, recording.tip_quaternion_wxyz)[now],
        "observation.target_pose": np.hstack(poses),
        GRANULES: _granule_counts(recording, handled),
        "action": np.hstack([recording.action_joint_positions_rad, recording.action_hand]),
        "action.joint_delta": joint_delta(recording),
        "action.tip_delta": tip_delta(recording),
        "next.success": last & episode.attempt.succeeded,
        "next.done": last,
        "phase": recording.phase.astype(np.int64),
        "active_literal": _active_literal(recording),
        "timestamp": (number / rate_hz).astype(np.float32),
        "frame_index": number,
        "episode_index": np.full(steps, episode_index),
        "index": first_index + number,
        "task_index": np.full(steps, task_index),
    }


def _granule_counts(recording: Recording, handled: np.ndarray) -> np.ndarray:
    """Return the granules in the handled object, in other vessels and in none, ``(T, 3)``; zeros if there are no granules.

    ``handled (T,)`` is the number of the handled object in each frame.
    """
    positions, held = recording.granule_positions_m, recording.granules_in_objects
    if positions is None or held is None:
        return np.zeros((recording.steps, 3), np.int64)
    in_target = held[np.arange(recording.steps), handled].astype(np.int64)
    in_others = held[:-1].sum(1, dtype=np.int64) - in_target
    return np.stack([in_target, in_others, positions.shape[1] - in_target - in_others], axis=1)


def _active_literal(recording: Recording) -> np.ndarray:
    """Return the index of the literal being worked on ``(T,)``; zeros for a goal with one literal."""
    told = recording.active_literal
    return np.zeros(recording.steps, np.int64) if told is None else told.astype(np.int64)


def schema_of(features: tuple[Feature, ...]) -> pa.Schema:
    """Return the schema of the data files, with the metadata from which Hugging Face's ``datasets`` reads types."""
    told = {
        f.name: {"dtype": f.dtype, "_type": "Value"}
        if f.names is None
        else {"feature": {"dtype": f.dtype, "_type": "Value"}, "length": f.width, "_type": "Sequence"}
        for f in features
    }
    metadata = {"huggingface": json.dumps({"info": {"features": told}})}
    return pa.schema([(f.name, f.arrow) for f in features], metadata=metadata)


def table_of(frames: dict[str, np.ndarray], features: tuple[Feature, ...], schema: pa.Schema) -> pa.Table:
    """Return an episode's frames as an Arrow table."""
    columns = []
    for feature in features:
        array = frames[feature.name]
        flat = pa.array(np.ascontiguousarray(array).ravel())
        columns.append(flat if feature.names is None else pa.FixedSizeListArray.from_arrays(flat, feature.width))
    return pa.Table.from_arrays(columns, schema=schema)
