"""Stored episode: the attempt, its recording, the robot and the objects."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import Any

from manitwin.episodes.attempts import Attempt
from manitwin.episodes.recording import Recording
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.robots.robot import OPENING, Robot
from manitwin.robots.two_arms import base_to_world
from manitwin.robots.urdf import UrdfTree


@dataclass(frozen=True)
class RecordedArm:
    """One of two arms: its name, number of joints, and base pose in the world."""

    name: str
    joints: int
    base_position_m: tuple[float, ...]
    base_quaternion_wxyz: tuple[float, ...]


@dataclass(frozen=True)
class RecordedRobot:
    """A robot by name and digest, with the names and limits of its joints; the arm's in the order of the recorded arrays.

    ``hand_state`` and ``hand_action`` name the recorded hand state and commands. ``arms`` are those of a two-arm robot, in
    the order of the arrays; empty for a single-arm robot.
    """

    name: str
    sha256: str
    arm_joints: tuple[str, ...]
    finger_joints: tuple[str, ...]
    lower_rad: tuple[float, ...]
    upper_rad: tuple[float, ...]
    velocity_limits_rad_s: tuple[float, ...]
    max_opening_m: float
    hand_state: tuple[str, ...] = (OPENING,)
    hand_action: tuple[str, ...] = (OPENING,)
    arms: tuple[RecordedArm, ...] = ()

    @property
    def arm_count(self) -> int:
        """The number of arms: one or two."""
        return len(self.arms) or 1

    @property
    def has_jaws(self) -> bool:
        """Whether each hand is a pair of jaws, recorded by its opening."""
        return bool(self.arms) or self.hand_state == (OPENING,)


@dataclass(frozen=True)
class RecordedObject:
    """An object of the scene: its name there, and its twin's id."""

    name: str
    twin_id: str


@dataclass(frozen=True)
class StoredEpisode:
    """An attempt with its recording; ``objects`` are in the recording's order.

    ``facts`` are further JSON values: the goal, the grasp, versions, settings.
    """

    attempt: Attempt
    recording: Recording
    robot: RecordedRobot
    objects: tuple[RecordedObject, ...]
    facts: dict[str, Any] = field(default_factory=dict)


def recorded_robot(robot: Robot) -> RecordedRobot:
    """Return the stored description of a robot; joint limits are those of its URDF."""
    limits = {
        name: (float(limit.get("lower", 0.0)), float(limit.get("upper", 0.0)))
        for name, joint in UrdfTree.of_text(robot.urdf).joints.items()
        if (limit := joint.find("limit")) is not None
    }
    arm = [limits[name] for name in robot.arm_joints]
    return RecordedRobot(
        name=robot.name,
        sha256=robot.sha256,
        arm_joints=tuple(robot.arm_joints),
        finger_joints=tuple(robot.finger_joints),
        lower_rad=tuple(low for low, _ in arm),
        upper_rad=tuple(high for _, high in arm),
        velocity_limits_rad_s=tuple(float(limit) for limit in robot.velocity_limits_rad_s),
        max_opening_m=float(robot.gripper.opening_m),
        hand_state=robot.hand_state_names,
        hand_action=robot.hand_action_names,
        arms=tuple(_recorded_arm(arm) for arm in robot.arms),
    )


def _recorded_arm(arm: Robot) -> RecordedArm:
    base = base_to_world(arm)
    return RecordedArm(
        arm.name,
        len(arm.arm_joints),
        tuple(base[:3, 3].tolist()),
        tuple(quaternion_wxyz(base[:3, :3]).tolist()),
    )


def to_json(episode: StoredEpisode) -> str:
    """Return an episode's non-array data as one line of JSON, deterministic for equal values."""
    said = {
        "attempt": asdict(episode.attempt),
        "robot": {name: value for name, value in asdict(episode.robot).items() if name != "arms" or value},
        "objects": [asdict(thing) for thing in episode.objects],
        "target": episode.recording.target,
        "facts": episode.facts,
    }
    return json.dumps(said, sort_keys=True, allow_nan=False, separators=(",", ":"))


def robot_from_dict(said: dict[str, Any]) -> RecordedRobot:
    """Return the robot given by a dict of its fields."""
    fields: dict[str, Any] = {n: tuple(value) if isinstance(value, list) else value for n, value in said.items()}
    fields["arms"] = tuple(
        RecordedArm(arm["name"], arm["joints"], tuple(arm["base_position_m"]), tuple(arm["base_quaternion_wxyz"]))
        for arm in said.get("arms", ())
    )
    return RecordedRobot(**fields)
