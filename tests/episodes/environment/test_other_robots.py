"""Tasks and environments of robots that are no arm with two jaws: two arms, a suction cup, a hand with joints."""

from __future__ import annotations

from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import manitwin
from grasped_twins import write_bar, write_brick
from manitwin.episodes.collect import batch_folders, stored_episodes
from manitwin.episodes.environment.action_limits import action_limits
from manitwin.episodes.episodes_run import make_episodes
from manitwin.episodes.planning.two_arms import planner_of
from manitwin.episodes.recording import tip_poses
from manitwin.episodes.settings import TasksConfig, TrajectoriesConfig
from manitwin.episodes.skills.robot_compatibility import skills_of
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.episodes.tasks.task_files import read_tasks
from manitwin.episodes.tasks.tasks_run import make_tasks
from manitwin.errors import UsageError
from manitwin.robots.load import load_robot
from manitwin.scenes.layouts.layouts_run import make_layouts
from manitwin.scenes.settings import LayoutsConfig, LayoutSettings

ROBOTS = {"ur5_suction": "suction", "xarm7_allegro": "allegro", "two_pandas": "panda"}


def made(root: Path, robot: str, tasks: int) -> list[StoredEpisode]:
    """A scene of three bricks (for two arms of two bars), tasks of a robot in it, and the episodes of these that were kept."""
    names = ("bar", "rod") if robot == "two_pandas" else ("brick", "block", "tea box")
    for number, name in enumerate(names):
        if robot == "two_pandas":
            write_bar(root / "things", number, name)
        else:
            write_brick(root / "things", number, name, gripper=ROBOTS[robot])
    layout = LayoutSettings(objects=(len(names),) * 2, upright=True, robot="panda", clutter="sparse")
    layouts = LayoutsConfig(seed=2, layout=layout)
    assert make_layouts(root / "things", root / "s", 1, layouts, executor="inline").exit_code == 0
    config = TasksConfig(seed=3, per_scene=tasks, two_literal_share=0.0, tries_of_kind=3, robot=robot)
    assert make_tasks(root / "s", root / "tasks", config, executor="inline")[0].exit_code == 0
    count = len(read_tasks(root / "tasks"))
    assert (
        make_episodes(root / "tasks", root / "e", count, TrajectoriesConfig(seed=1), executor="inline").exit_code == 0
    )
    return list(stored_episodes(batch_folders(root / "e")))


def replayed(env: gymnasium.Env, episode: StoredEpisode, hand: float | None = None) -> dict:
    """Give an episode's commands to an environment, where the states have to be the same; ``hand``: told instead of its own."""
    recording, info = episode.recording, {}
    told = recording.action_hand if hand is None else np.full_like(recording.action_hand, hand)
    env.reset(seed=0)
    for number, action in enumerate(np.column_stack([recording.action_joint_positions_rad, told]), start=1):
        observation, _, terminated, _, info = env.step(action)
        assert env.observation_space.contains(observation)
        if hand is None:
            objects = np.hstack([recording.object_positions_m[number], recording.object_quaternions_wxyz[number]])
            tips = tip_poses(recording.tip_position_m, recording.tip_quaternion_wxyz)
            np.testing.assert_array_equal(observation["object_poses"], objects)
            np.testing.assert_array_equal(observation["tip_pose"], tips[number])
            np.testing.assert_array_equal(observation["joint_positions_rad"], recording.joint_positions_rad[number])
        if terminated:
            break
    return info


@pytest.mark.parametrize(
    ("robot", "open_hand"), [("ur5_suction", 0.0), pytest.param("xarm7_allegro", None, marks=pytest.mark.slow)]
)
@pytest.mark.filterwarnings("ignore:.*symmetric and normalized")
def test_a_robot_with_another_hand_gets_tasks_and_repeats_them_in_their_environment(
    tmp_path: Path, robot: str, open_hand: float | None
) -> None:
    kept = made(tmp_path, robot, 4)
    assert kept
    assert {episode.robot.name for episode in kept} == {robot}, "the robot of the tasks, where none is named"
    for episode in kept:
        env = manitwin.make_env(tmp_path / "tasks", episode.attempt.task_id)
        assert replayed(env, episode)["success"], episode.attempt
        env.close()
    if open_hand is not None:
        env = manitwin.make_env(tmp_path / "tasks", kept[0].attempt.task_id)
        assert not replayed(env, kept[0], open_hand)["success"], "without vacuum nothing is held"
        env.close()
    env = manitwin.make_env(tmp_path / "tasks", kept[0].attempt.task_id, max_steps=5)
    check_env(env, skip_render_check=True)
    env.close()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*symmetric and normalized")
def test_two_arms_get_tasks_of_both_and_of_the_first_and_repeat_them(tmp_path: Path) -> None:
    kept = made(tmp_path, "two_pandas", 8)
    by_skill = {episode.attempt.skill: episode for episode in kept}
    assert "handover" in by_skill
    assert len(by_skill) >= 3, "what one arm does, the first of two does"
    other = next(name for name in by_skill if name != "handover")
    for name in ("handover", other):
        episode = by_skill[name]
        joints = episode.recording.joint_positions_rad
        assert (np.ptp(joints[:, 7:], axis=0).max() > 0.1) == (name == "handover"), (
            "the second arm stands where it alone is not asked"
        )
        env = manitwin.make_env(tmp_path / "tasks", episode.attempt.task_id)
        assert env.action_space.shape == (16,)
        assert replayed(env, episode)["success"], name
        env.close()
    env = manitwin.make_env(tmp_path / "tasks", by_skill["handover"].attempt.task_id)
    info = replayed(env, by_skill["handover"], hand=0.08)
    assert info["failure"].endswith("not_taken")
    env.close()
    with pytest.raises(UsageError, match="skill handover needs two arms, but panda has one"):
        make_episodes(tmp_path / "tasks", tmp_path / "one", 8, TrajectoriesConfig(robot="panda"), executor="inline")
    with pytest.raises(UsageError, match="skill handover needs two arms, but panda has one"):
        manitwin.make_env(tmp_path / "tasks", by_skill["handover"].attempt.task_id, robot="panda")
    noise = manitwin.StartNoise(joints_rad=0.02)
    env = manitwin.make_env(tmp_path / "tasks", by_skill["handover"].attempt.task_id, max_steps=5, start_noise=noise)
    check_env(env, skip_render_check=True)
    _, info = env.reset(seed=4)
    assert info["start_noise"]["joint_offsets_rad"].shape == (14,)
    assert np.abs(info["start_noise"]["joint_offsets_rad"]).min() > 0
    env.close()


def test_a_robot_has_the_skills_of_its_arms_and_hand() -> None:
    names = {robot: {skill.name for skill in skills_of(load_robot(robot))} for robot in ("panda", *ROBOTS)}
    assert "handover" not in names["panda"]
    assert names["two_pandas"] == names["panda"] | {"handover"}
    assert names["ur5_suction"] == names["xarm7_allegro"] <= names["panda"]
    assert {"place_in", "stack", "near", "upright"} <= names["ur5_suction"]
    assert not {"pour", "push", "press"} & names["ur5_suction"]


@pytest.mark.parametrize("name", ["panda", *ROBOTS])
def test_limits_of_actions_hold_what_the_robot_begins_with(name: str) -> None:
    robot = load_robot(name)
    lowest, highest = action_limits(robot, planner_of(robot, 1 / 120))
    assert len(lowest) == len(highest) == len(robot.arm_joints) + len(robot.hand_action_names)
    joints = len(robot.arm_joints)
    if name == "panda":
        assert (lowest[0], highest[0]) == pytest.approx((-2.8973, 2.8973), abs=1e-6), "the URDF's"
    assert (lowest[:joints] <= robot.home_rad).all()
    assert (highest[:joints] >= robot.home_rad).all()
