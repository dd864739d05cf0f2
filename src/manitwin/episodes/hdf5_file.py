"""HDF5 storage of recorded episodes in the layout of ManiSkill's demonstrations.

Source: ManiSkill's docs/source/user_guide/datasets/demos.md, mani_skill/utils/wrappers/record.py (groups and types) and
mani_skill/utils/structs/articulation.py (a state is pose, velocities of the root, joint positions, joint velocities).

docs/episodes.md describes every data set. Reading needs only h5py, and HDF5 1.10 or later. The output is deterministic to the
byte.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

import h5py
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, TypeAdapter, ValidationError

from manitwin.episodes.attempts import Attempt, attempt_from
from manitwin.episodes.handled_objects import handled_objects
from manitwin.episodes.recording import RATE_HZ, Recording, joint_delta, tip_delta, tip_poses
from manitwin.episodes.recording_arrays import GRANULES, LITERAL, checked_recording
from manitwin.episodes.stored_episode import (
    RecordedArm,
    RecordedObject,
    RecordedRobot,
    StoredEpisode,
    robot_from_dict,
    to_json,
)
from manitwin.errors import EpisodesError
from manitwin.formats.hdf5_file import Hdf5
from manitwin.formats.json_file import parse_json_object
from manitwin.formats.printable import printable_line
from manitwin.robots.robot import OPENING
from manitwin.twin.store import atomic_file

LIBVER = ("v110", "v110")
"""Small groups and single chunks need no index: a fifth smaller than the oldest format (measured with 29 arrays per episode)."""

EPISODE = "episode"
"""Attribute of a trajectory's group with all non-array data as JSON."""

_REMEDY = "write the episodes again"
EXTRA = "manitwin"
"""Group of data without a place in ManiSkill's layout."""

_NAME = r"^[0-9A-Za-z_-][0-9A-Za-z_. -]*$"
"""Valid names of groups in the file and of twin folders."""

_COMPRESSED_BYTES = 512
"""Smaller arrays are stored uncompressed, because compression would not shrink them."""


class _StrictModel(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class _SaidArm(_StrictModel):
    name: str = Field(pattern=_NAME)
    joints: int = Field(ge=1, le=64)
    base_position_m: list[FiniteFloat] = Field(min_length=3, max_length=3)
    base_quaternion_wxyz: list[FiniteFloat] = Field(min_length=4, max_length=4)


class _SaidRobot(_StrictModel):
    name: str = Field(pattern=_NAME)
    sha256: str
    arm_joints: list[str] = Field(min_length=1, max_length=64)
    finger_joints: list[str] = Field(max_length=64)
    lower_rad: list[FiniteFloat]
    upper_rad: list[FiniteFloat]
    velocity_limits_rad_s: list[FiniteFloat]
    max_opening_m: FiniteFloat
    hand_state: list[str] = Field(default=[OPENING], min_length=1, max_length=64)
    hand_action: list[str] = Field(default=[OPENING], min_length=1, max_length=64)
    arms: list[_SaidArm] = Field(default=[], max_length=2)


class _SaidObject(_StrictModel):
    name: str = Field(pattern=_NAME)
    twin_id: str = Field(pattern=_NAME)


class EpisodeMetadata(_StrictModel):
    """Schema of an episode's non-array data; ``attempt_from`` validates the fields of the attempt."""

    attempt: dict[str, Any]
    robot: _SaidRobot
    objects: list[_SaidObject] = Field(min_length=1, max_length=10_000)
    target: int = Field(ge=0)
    facts: dict[str, Any]


_ATTEMPT = TypeAdapter(Attempt)


def write_episodes(path: Path, episodes: Iterable[StoredEpisode]) -> int:
    """Write episodes as ``traj_0``, ``traj_1``, ... atomically, and return their number.

    Raises EpisodesError for a recording with inconsistent or non-finite arrays.
    """
    count = 0
    with atomic_file(path) as beside, h5py.File(beside, "w", libver=LIBVER) as file:
        for count, episode in enumerate(episodes, start=1):
            _write(file.create_group(f"traj_{count - 1}"), episode)
    return count


class EpisodeFile:
    """Episodes of a file, read one at a time.

    Raises EpisodesError if the file is missing, or its groups are not ``traj_0`` to ``traj_<n - 1>``.
    """

    def __init__(self, path: Path):
        self.path = path
        self.content = Hdf5(path, EpisodesError, remedy=_REMEDY)
        try:
            names = set(self.content.names())
            self.count = len(names)
            missing = next((i for i in range(self.count) if f"traj_{i}" not in names), None)
            if missing is not None:
                raise EpisodesError(f"{path}: {self.count} groups, but no traj_{missing}; {_REMEDY}")
        except BaseException:
            self.content.close()
            raise

    def __enter__(self) -> EpisodeFile:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.content.close()

    def __len__(self) -> int:
        return self.count

    def __iter__(self) -> Iterator[StoredEpisode]:
        return (self[number] for number in range(self.count))

    def __getitem__(self, number: int) -> StoredEpisode:
        if not 0 <= number < self.count:
            raise IndexError(f"{self.path} has {self.count} episodes, not number {number}")
        return _read(self.content, f"traj_{number}", self.metadata(number), f"{self.path}: traj_{number}")

    def metadata(self, number: int) -> dict[str, Any]:
        """Return an episode's non-array data: ``attempt, robot, objects, target, facts``."""
        return _read_metadata(self.content.text(f"traj_{number}", EPISODE), f"{self.path}: traj_{number}")


def _read_metadata(content: bytes | None, where: str) -> dict[str, Any]:
    """Return the validated JSON of a trajectory's group; raises EpisodesError."""
    if content is None:
        raise EpisodesError(
            f"{where}: no attribute {EPISODE!r}, so it was not written by this package; give a file written by manitwin"
        )
    said = parse_json_object(content, where, EpisodesError, remedy=_REMEDY)
    try:
        EpisodeMetadata.model_validate(said)
        _ATTEMPT.validate_json(json.dumps(said["attempt"]), strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        place = printable_line(".".join(map(str, first["loc"])), max_characters=80)
        raise EpisodesError(f"{where}: {place}: {first['msg']}; {_REMEDY}") from error
    return said


def _write(group: h5py.Group, episode: StoredEpisode) -> None:
    recording = checked_recording(episode)
    steps, hand = recording.steps, _hand_joints(recording.hand, episode.robot)
    positions = np.hstack([recording.joint_positions_rad, hand])
    speeds = np.append(np.diff(hand, axis=0) * np.float32(RATE_HZ), np.zeros((1, hand.shape[1]), np.float32), axis=0)
    velocities = np.hstack([recording.joint_velocities_rad_s, speeds])
    ended = np.arange(steps) == steps - 1
    poses = np.concatenate([recording.object_positions_m, recording.object_quaternions_wxyz], axis=2)
    states = np.concatenate(
        [poses, recording.object_linear_velocities_m_s, recording.object_angular_velocities_rad_s], axis=2
    )
    group.attrs[EPISODE] = np.bytes_(to_json(episode).encode())
    arrays: dict[str, np.ndarray] = {
        "obs/agent/qpos": positions,
        "obs/agent/qvel": velocities,
        "obs/extra/tcp_pose": tip_poses(recording.tip_position_m, recording.tip_quaternion_wxyz),
        "obs/extra/obj_pose": poses[np.arange(steps + 1), handled_objects(episode)],
        "actions": np.hstack([recording.action_joint_positions_rad, recording.action_hand]),
        "terminated": ended,
        "truncated": np.zeros(steps, bool),
        "success": ended & episode.attempt.succeeded,
        **{f"env_states/actors/{thing.name}": states[:, i] for i, thing in enumerate(episode.objects)},
        **_articulations(episode.robot, positions, velocities),
        f"{EXTRA}/phase": recording.phase,
        f"{EXTRA}/finger_forces_n": recording.finger_forces_n,
        f"{EXTRA}/target_on_support": recording.target_on_support,
        f"{EXTRA}/unplanned_contact": recording.unplanned_contact,
        f"{EXTRA}/action_tip_pose": tip_poses(recording.action_tip_position_m, recording.action_tip_quaternion_wxyz),
        f"{EXTRA}/action_joint_delta": joint_delta(recording),
        f"{EXTRA}/action_tip_delta": tip_delta(recording),
        **{
            f"{EXTRA}/{name}": found for name in (*GRANULES, LITERAL) if (found := getattr(recording, name)) is not None
        },
    }
    for name, array in arrays.items():
        packing = {"compression": "gzip", "compression_opts": 4, "shuffle": True, "chunks": array.shape}
        group.create_dataset(
            name, data=array, track_times=False, **(packing if array.nbytes > _COMPRESSED_BYTES else {})
        )


def _hand_joints(hand: np.ndarray, robot: RecordedRobot) -> np.ndarray:
    """Return the positions of the hand's joints ``(T + 1, J)``; for jaws, half of the opening each."""
    return np.repeat(hand / 2, 2, axis=1) if robot.has_jaws else hand


def _articulations(robot: RecordedRobot, positions: np.ndarray, velocities: np.ndarray) -> dict[str, np.ndarray]:
    """Return the states of the robot, or of each arm: the stationary base, and the arm's joints before the hand's."""
    arms = robot.arms or (RecordedArm(robot.name, len(robot.arm_joints), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),)
    hand = (positions.shape[1] - len(robot.arm_joints)) // len(arms)
    found, first = {}, 0
    for number, arm in enumerate(arms):
        base = np.zeros((len(positions), 13), np.float32)
        base[:, :3], base[:, 3:7] = arm.base_position_m, arm.base_quaternion_wxyz
        after = len(robot.arm_joints) + number * hand
        own = np.r_[first : first + arm.joints, after : after + hand]
        found[f"env_states/articulations/{arm.name}"] = np.hstack([base, positions[:, own], velocities[:, own]])
        first += arm.joints
    return found


def _read(content: Hdf5, group: str, said: dict[str, Any], where: str) -> StoredEpisode:
    robot, objects = robot_from_dict(said["robot"]), tuple(RecordedObject(**thing) for thing in said["objects"])
    arm = len(robot.arm_joints)

    def array(name: str, width: int | None = None) -> np.ndarray:
        found = content.array(f"{group}/{name}")
        if found.ndim != (1 if width is None else 2) or (width is not None and found.shape[1] != width):
            raise EpisodesError(f"{where}: {name} has the shape {found.shape}; {_REMEDY}")
        return found

    # (T + 1, objects, 13); there is at least one object, because there is a target
    each = [array(f"env_states/actors/{thing.name}", 13) for thing in objects]
    if len({len(states) for states in each}) != 1:
        raise EpisodesError(f"{where}: its objects have different numbers of states; {_REMEDY}")
    states = np.stack(each, axis=1)
    jaws, arms = robot.has_jaws, robot.arm_count
    if robot.arms and sum(each.joints for each in robot.arms) != arm:
        raise EpisodesError(f"{where}: its arms have other joints than the robot; {_REMEDY}")
    width = arm + (2 if jaws else 1) * len(robot.hand_state)
    positions, velocities = array("obs/agent/qpos", width), array("obs/agent/qvel", width)
    tip, action_tip = (
        array(name, 7 * arms).reshape(-1, arms, 7) for name in ("obs/extra/tcp_pose", f"{EXTRA}/action_tip_pose")
    )
    actions = array("actions", arm + len(robot.hand_action))
    extra = {name: array(f"{EXTRA}/{name}") for name in ("phase", "target_on_support", "unplanned_contact")}
    extra["finger_forces_n"] = array(f"{EXTRA}/finger_forces_n", 2 * arms)
    if has_granules(content, group):
        extra |= {name: content.array(f"{group}/{EXTRA}/{name}") for name in GRANULES}
        middles, held = (extra[name].shape for name in GRANULES)
        if len(middles) != 3 or middles[::2] != (len(states), 3) or held != states.shape[:2]:
            raise EpisodesError(f"{where}: granules have the shapes {middles} and {held}; {_REMEDY}")
    if content.has(f"{group}/{EXTRA}/{LITERAL}"):
        extra[LITERAL] = array(f"{EXTRA}/{LITERAL}")
    recording = Recording(
        target=said["target"],
        joint_positions_rad=positions[:, :arm],
        joint_velocities_rad_s=velocities[:, :arm],
        hand=2 * positions[:, arm::2] if jaws else positions[:, arm:],
        tip_position_m=tip[..., :3].reshape(len(tip), -1),
        tip_quaternion_wxyz=tip[..., 3:].reshape(len(tip), -1),
        object_positions_m=states[..., :3],
        object_quaternions_wxyz=states[..., 3:7],
        object_linear_velocities_m_s=states[..., 7:10],
        object_angular_velocities_rad_s=states[..., 10:],
        action_joint_positions_rad=actions[:, :arm],
        action_hand=actions[:, arm:],
        action_tip_position_m=action_tip[..., :3].reshape(len(action_tip), -1),
        action_tip_quaternion_wxyz=action_tip[..., 3:].reshape(len(action_tip), -1),
        **extra,
    )
    return StoredEpisode(attempt_from(said["attempt"]), recording, robot, objects, said["facts"])


def has_granules(content: Hdf5, group: str) -> bool:
    """Tell whether a trajectory has granules."""
    return content.has(f"{group}/{EXTRA}/{GRANULES[1]}")
