"""What an environment does with actions that are none, and with such as no arm can follow."""

from __future__ import annotations

import copy
import os
import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from grasped_twins import write_brick
from manitwin.episodes.environment.action_limits import checked_action
from manitwin.episodes.environment.environment import TaskEnvironment
from manitwin.episodes.environment.environment_factory import make_env
from manitwin.episodes.recording import RATE_HZ
from manitwin.episodes.settings import TasksConfig
from manitwin.episodes.tasks.task_files import read_tasks
from manitwin.episodes.tasks.tasks_run import make_tasks
from manitwin.errors import UsageError
from manitwin.robots.load import load_robot
from manitwin.scenes.layouts.layouts_run import make_layouts
from manitwin.scenes.settings import LayoutsConfig, LayoutSettings

NAMES = ("shoulder", "elbow", "gripper_opening_m")


@pytest.mark.parametrize(
    ("action", "said"),
    [
        ([0.1, np.nan, 0.04], "action is not finite for elbow; check the output of the policy"),
        ([np.inf, 0.0, -np.inf], "action is not finite for shoulder, gripper_opening_m"),
        ([0.1, 0.2], r"action has shape \(2,\); give 3 numbers: shoulder, elbow, gripper_opening_m"),
        ([[0.1, 0.2, 0.04]], r"action has shape \(1, 3\)"),
        (0.1, r"action has shape \(\)"),
        ("left", "action: not numbers"),
        (None, "action"),
    ],
)
def test_what_is_no_action_is_said(action: object, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        checked_action(action, NAMES)


def test_actions_are_floats() -> None:
    assert checked_action((0, 1, 0.04), NAMES).tolist() == [0.0, 1.0, 0.04]


@pytest.fixture(scope="module")
def env(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TaskEnvironment]:
    root = tmp_path_factory.mktemp("bricks")
    for number in range(2):
        write_brick(root / "things", number, ("brick", "block")[number])
    layouts = LayoutsConfig(seed=2, layout=LayoutSettings(objects=(2, 2), robot="panda", clutter="sparse"))
    make_layouts(root / "things", root / "s", 1, layouts, executor="inline")
    config = TasksConfig(seed=3, per_scene=1, two_literal_share=0.0, tries_of_kind=2)
    make_tasks(root / "s", root / "tasks", config, executor="inline")
    tasks = Path(os.path.relpath(root / "tasks"))
    made = make_env(tasks, read_tasks(tasks)[0].task_id)
    yield made
    made.close()


def test_environment_goes_on_from_where_it_was_after_what_was_no_action(env: TaskEnvironment) -> None:
    before, _ = env.reset(seed=0)
    for action in (np.full(8, np.nan), np.zeros(7)):
        with pytest.raises(UsageError, match="action"):
            env.step(action)
    after, *_ = env.step(np.append(before["joint_positions_rad"], before["gripper_opening_m"]))
    assert after["joint_positions_rad"] == pytest.approx(before["joint_positions_rad"], abs=1e-3)


def test_joints_go_no_faster_than_their_motors_whatever_they_are_told(env: TaskEnvironment) -> None:
    observation, _ = env.reset(seed=0)
    home, fastest_rad_s = observation["joint_positions_rad"], load_robot("panda").fastest_rad_s
    for steps in range(1, 6):
        observation, *_ = env.step(env.action_space.high)
        gone = np.abs(observation["joint_positions_rad"] - home)
        assert (gone <= 1.1 * fastest_rad_s * steps / RATE_HZ + 0.02).all()
    assert gone.min() > 0.8 * fastest_rad_s.min() * 5 / RATE_HZ, "it goes as fast as it can"


def test_environment_is_made_anew_of_its_pickle_in_any_folder(
    env: TaskEnvironment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, _ = env.reset(seed=0)
    action = np.append(before["joint_positions_rad"], before["gripper_opening_m"]) + np.float32(0.02)
    after, *_ = env.step(action)
    monkeypatch.chdir(tmp_path)
    for other in (pickle.loads(pickle.dumps(env)), copy.deepcopy(env)):
        with pytest.raises(UsageError, match="step before reset"):
            other.step(action)
        begun, _ = other.reset(seed=0)
        gone_on, *_ = other.step(action)
        other.close()
        for seen, same in ((before, begun), (after, gone_on)):
            assert all(np.array_equal(seen[name], same[name]) for name in seen)


def test_environment_of_no_known_maker_is_not_pickled(env: TaskEnvironment, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(env, "_made_by", None)
    with pytest.raises(pickle.PicklingError, match="make one in each process"):
        pickle.dumps(env)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"max_steps": 0}, "max_steps is 0; give a whole number, 1 or more"),
        ({"max_steps": 2.5}, "max_steps is 2.5"),
        ({"picture_px": 0, "cameras": ("front",)}, "picture_px is 0; give a whole number, 1 or more"),
        ({"picture_px": -3}, "picture_px is -3"),
        ({"rate_hz": 30}, "unknown rate '30'"),
        ({"cameras": "front"}, r"cameras is 'front'; give a tuple of names: \('front',\)"),
    ],
)
def test_settings_that_are_none_are_refused_by_name(given: dict[str, Any], said: str) -> None:
    with pytest.raises(UsageError, match=said):
        make_env("tasks", **given)
