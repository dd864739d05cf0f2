"""Made-up episodes of a real arm with made twins: a can is grasped, lifted and set down elsewhere; a run's folders of them."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from drawn_scenes import write_scenes
from manitwin.episodes.attempts import ATTEMPTS, Attempt, merge_attempts, write_attempts
from manitwin.episodes.batch import BATCHES
from manitwin.episodes.episodes_stage import EPISODES
from manitwin.episodes.fixtures import block, to_json
from manitwin.episodes.hdf5_file import write_episodes
from manitwin.episodes.recording import Recording
from manitwin.episodes.replay_pictures import link_poses
from manitwin.episodes.settings import TrajectoriesConfig
from manitwin.episodes.stored_episode import RecordedObject, StoredEpisode, recorded_robot
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.robots.load import load_robot
from manitwin.scenes.scene_files import read_scene, scene_files

STEPS, GRASPED, LIFTED, SET_DOWN, RELEASED = 24, 8, 10, 18, 20
"""States; the can is held from the second to before the last, and aloft from the third to before the fourth."""


def recording(steps: int = STEPS, objects: int = 2, target: int = 0) -> Recording:
    """All joints of a Panda move; object ``target`` rises by 20 cm and goes 10 cm to the side, the others stand."""
    robot = load_robot("panda")
    time = np.linspace(0, 1, steps + 1)
    joints = robot.home_rad + 0.2 * np.sin(2 * np.pi * time[:, None] + np.arange(7))
    hand = np.where((np.arange(steps + 1) >= GRASPED) & (np.arange(steps + 1) < RELEASED), 0.07, 0.08)[:, None]
    poses = [link_poses(robot, q, h)[robot.tip_link] @ robot.gripper_to_tip for q, h in zip(joints, hand, strict=True)]
    tips = np.array(poses)
    positions = np.tile([[0.45 + 0.15 * i, 0.1 * i, 0.0] for i in range(objects)], (steps + 1, 1, 1))
    along = np.clip((np.arange(steps + 1) - LIFTED + 1) / (SET_DOWN - LIFTED), 0, 1)
    positions[:, target, 1] += 0.1 * along
    positions[:, target, 2] += 0.2 * np.sin(np.pi * along)
    states = np.arange(steps + 1)

    def zeros(*shape: int) -> np.ndarray:
        return np.zeros((steps + 1, *shape), np.float32)

    forces = zeros(2)
    forces[GRASPED:RELEASED] = (30.0, 31.0)
    return Recording(
        target=target,
        joint_positions_rad=joints.astype(np.float32),
        joint_velocities_rad_s=zeros(7),
        hand=hand.astype(np.float32),
        tip_position_m=tips[:, :3, 3].astype(np.float32),
        tip_quaternion_wxyz=quaternion_wxyz(tips[:, :3, :3]).astype(np.float32),
        object_positions_m=positions.astype(np.float32),
        object_quaternions_wxyz=np.tile(np.array([1, 0, 0, 0], np.float32), (steps + 1, objects, 1)),
        object_linear_velocities_m_s=zeros(objects, 3),
        object_angular_velocities_rad_s=zeros(objects, 3),
        finger_forces_n=forces,
        target_on_support=(states < LIFTED) | (states >= SET_DOWN),
        unplanned_contact=zeros().astype(bool),
        action_joint_positions_rad=joints[1:].astype(np.float32),
        action_hand=hand[1:].astype(np.float32),
        action_tip_position_m=tips[1:, :3, 3].astype(np.float32),
        action_tip_quaternion_wxyz=quaternion_wxyz(tips[1:, :3, :3]).astype(np.float32),
        phase=(np.arange(steps) * 9 // steps).astype(np.uint8),
    )


def attempt(number: int, **changes: Any) -> Attempt:
    """An attempt that succeeded, unless the changes say otherwise."""
    made = Attempt(
        episode_id=f"episode-{number:08d}", robot="panda", skill="pick_place", twin_id="", category="can", scene_id=None,
        seed=number, others=1, outcome="kept", grasp_id="panda-0001", grasp_type="pinch", transferred=False, grasps_tried=3,
        plan_failures='{"no_path": 2}', position_error_m=0.002, tilt_rad=0.01, yaw_error_rad=0.0, slip_m=0.001, length_s=1.2,
        instructions=("move the can to the left", "put the can down further left"),
    )  # fmt: skip
    return replace(made, **changes)


def stored(root: Path, number: int, given: Recording | None = None, **changes: Any) -> StoredEpisode:
    """An episode of twins of the data set at ``root/set``, with a block as a fixture."""
    record = read_scene(scene_files(root / "scenes")[0])
    ids = {each.category: each.twin_id for each in record.objects}
    given = given or recording()
    names = ["can", "box", *["box"] * given.object_positions_m.shape[1]][: given.object_positions_m.shape[1]]
    goal = np.eye(4)
    goal[:3, 3] = (0.45, 0.1, 0.0)
    facts = {
        "furniture": record.furniture.model_dump(mode="json"),
        "ambient": list(record.ambient),
        "lights": [each.model_dump(mode="json") for each in record.lights],
        "goal_object_to_world": goal.tolist(),
        "fixtures": [to_json(block(np.array([0.6, -0.3, 0.0]), 0.5))],
        **changes.pop("facts", {}),
    }
    objects = tuple(RecordedObject(f"object_{place:02d}", ids[name]) for place, name in enumerate(names))
    return StoredEpisode(
        attempt(number, twin_id=ids["can"], **changes), given, recorded_robot(load_robot("panda")), objects, facts
    )


def write_run(root: Path, episodes: list[StoredEpisode] | None = None, failed: tuple[Attempt, ...] = ()) -> Path:
    """Write a finished run at ``root/episodes`` of the data set ``root/set``; those that ``failed`` come first."""
    if not (root / "set").is_dir():
        write_scenes(root)
    kept = [stored(root, number) for number in range(2)] if episodes is None else episodes
    out = write_batch(root, kept, failed)
    merge_attempts([out / BATCHES / "aa" / "aabatch" / ATTEMPTS], out / ATTEMPTS)
    (out / "maniskill").mkdir()
    write_episodes(out / "maniskill" / "trajectory.h5", kept)
    return out


def write_batch(
    root: Path, episodes: list[StoredEpisode], failed: tuple[Attempt, ...] = (), name: str = "aabatch"
) -> Path:
    """Write a batch of a run that goes on at ``root/episodes``, which is returned."""
    out = root / "episodes"
    folder = out / BATCHES / name[:2] / name
    folder.mkdir(parents=True)
    write_episodes(folder / EPISODES, episodes)
    write_attempts(folder / ATTEMPTS, [*failed, *(each.attempt for each in episodes)])
    said = {"dataset": str(root / "set"), "scenes": None, "robot": "panda", "skill": "pick_place", "seed": 0}
    config = TrajectoriesConfig()
    said |= {
        "episode": asdict(config.episode) if not hasattr(config.episode, "model_dump") else config.episode.model_dump()
    }
    (out / "config.json").write_text(json.dumps({**said, "retire_failed_share": config.retire_failed_share}))
    return out
