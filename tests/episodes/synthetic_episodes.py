"""Made-up episodes: joints move as sines, the target object follows the tip, the others stand still."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.attempts import NEVER_EXECUTED, Attempt
from manitwin.episodes.recording import RATE_HZ, Recording
from manitwin.episodes.stored_episode import RecordedObject, RecordedRobot, StoredEpisode

CATEGORIES = ("mug", "bottle", "hammer")


def robot(arm: int = 7, name: str = "panda") -> RecordedRobot:
    return RecordedRobot(
        name=name,
        sha256="0" * 64,
        arm_joints=tuple(f"{name}_joint{i + 1}" for i in range(arm)),
        finger_joints=("finger_left", "finger_right"),
        lower_rad=(-2.5,) * arm,
        upper_rad=(2.5,) * arm,
        velocity_limits_rad_s=(2.0,) * arm,
        max_opening_m=0.08,
    )


def recording(seed: int, steps: int, arm: int = 7, things: int = 3) -> Recording:
    rng = np.random.default_rng(seed)
    time_s = np.arange(steps + 1)[:, None] / RATE_HZ
    phase = rng.uniform(0, 2 * np.pi, arm)
    joints = np.sin(time_s + phase)
    tip = np.stack([0.5 + 0.1 * np.cos(time_s[:, 0]), 0.1 * np.sin(time_s[:, 0]), 0.3 + 0 * time_s[:, 0]], axis=1)
    turned = Rotation.from_euler("ZX", np.hstack([0.3 * time_s, np.full_like(time_s, 3.0)]))
    ahead = Rotation.from_euler("ZX", np.hstack([0.3 * (time_s + 1 / RATE_HZ), np.full_like(time_s, 3.0)]))
    positions = np.tile(rng.uniform(-0.3, 0.3, (things, 3)), (steps + 1, 1, 1))
    target = int(rng.integers(things))
    positions[:, target] = tip - [0, 0, 0.1]
    quaternions = np.tile([1.0, 0, 0, 0], (steps + 1, things, 1))
    speeds = np.zeros((steps + 1, things, 3))
    speeds[:, target, 0] = -0.1 * np.sin(time_s[:, 0])
    opening = 0.04 + 0.04 * np.cos(time_s[:, 0])
    real = {
        "joint_positions_rad": joints,
        "joint_velocities_rad_s": np.cos(time_s + phase),
        "hand": opening[:, None],
        "tip_position_m": tip,
        "tip_quaternion_wxyz": turned.as_quat(scalar_first=True),
        "object_positions_m": positions,
        "object_quaternions_wxyz": quaternions,
        "object_linear_velocities_m_s": speeds,
        "object_angular_velocities_rad_s": np.zeros_like(speeds),
        "finger_forces_n": rng.uniform(0, 50, (steps + 1, 2)),
        "action_joint_positions_rad": np.sin(time_s[:-1] + 1 / RATE_HZ + phase),
        "action_hand": opening[1:, None],
        "action_tip_position_m": tip[1:],
        "action_tip_quaternion_wxyz": ahead.as_quat(scalar_first=True)[:-1],
    }
    return Recording(
        target=target,
        target_on_support=np.arange(steps + 1) % 7 < 3,
        unplanned_contact=np.zeros(steps + 1, bool),
        phase=(np.arange(steps) * 9 // steps).astype(np.uint8),
        **{name: array.astype(np.float32) for name, array in real.items()},
    )


def with_granules(given: StoredEpisode, count: int = 9) -> StoredEpisode:
    """The episode with granules that pass, one a step, from the target to the object after it, the last one beside it."""
    taken, things = given.recording, len(given.objects)
    rows, other = taken.steps + 1, (taken.target + 1) % things
    held = np.zeros((rows, things), np.int16)
    gone = np.minimum(np.arange(rows), count)
    held[:, taken.target], held[:, other] = count - gone, np.minimum(gone, count - 1)
    positions = np.linspace(0, 1, rows * count * 3, dtype=np.float32).reshape(rows, count, 3)
    return replace(given, recording=replace(taken, granule_positions_m=positions, granules_in_objects=held))


def attempt(number: int, *, outcome: str = "kept", robot_name: str = "panda", **changes: Any) -> Attempt:
    category = CATEGORIES[number % len(CATEGORIES)]
    executed, ended = (
        outcome not in NEVER_EXECUTED,
        outcome in ("kept", "unplanned_contact", "disturbed"),
    )
    made = Attempt(
        episode_id=f"episode{number:06d}",
        robot=robot_name,
        skill="pick_place",
        twin_id=f"{category}_{number % 6:02d}",
        category=category,
        scene_id=f"scene{number // 3}",
        seed=number,
        others=number % 4,
        outcome=outcome,
        grasp_id=f"grasp{number % 5}" if executed else None,
        grasp_type="pinch" if executed else None,
        transferred=False,
        grasps_tried=1 + number % 3,
        plan_failures='{"approach_blocked": 2, "no_path": 1}' if number % 2 else "{}",
        position_error_m=0.001 * (1 + number % 5) if ended else None,
        tilt_rad=0.01 if ended else None,
        yaw_error_rad=0.02 if ended else None,
        slip_m=0.002 if ended else None,
        length_s=6.0 + number % 4 if executed else None,
        instructions=(f"pick up the {category}", f"move the {category} to the left", "put it down") if executed else (),
    )
    return replace(made, **changes)


def episode(
    number: int, *, steps: int | None = None, of: RecordedRobot | None = None, things: int = 3
) -> StoredEpisode:
    of = of or robot()
    length = 20 + number % 7 if steps is None else steps
    return StoredEpisode(
        attempt=attempt(number, robot_name=of.name, length_s=length / RATE_HZ),
        recording=recording(number, length, len(of.arm_joints), things),
        robot=of,
        objects=tuple(RecordedObject(f"object_{i:02d}", f"twin{i}") for i in range(things)),
        facts={"goal_position_m": [0.4, 0.1, 0.0], "number": number},
    )
