"""Tasks of a scene of bricks: found, checked, said, stored, carried out, and replayed in the environment."""

from __future__ import annotations

import json
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import manitwin
from grasped_twins import write_brick
from manitwin.episodes.attempts import ATTEMPTS, read_attempts
from manitwin.episodes.collect import batch_folders, collect, stored_episodes
from manitwin.episodes.downsampling import downsample
from manitwin.episodes.episodes_run import make_episodes
from manitwin.episodes.recording import Recording
from manitwin.episodes.settings import TasksConfig, TrajectoriesConfig
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.episodes.tasks.bddl import bddl_of
from manitwin.episodes.tasks.task_files import TASKS, one_task, read_tasks, tasks_bytes
from manitwin.episodes.tasks.task_record import TaskRecord
from manitwin.episodes.tasks.tasks_run import REPORT, balanced_tasks, make_tasks
from manitwin.errors import UsageError
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.server import FakeServer
from manitwin.scenes.layouts.layouts_run import make_layouts
from manitwin.scenes.scene_files import read_scene, scene_files
from manitwin.scenes.settings import LayoutsConfig, LayoutSettings

GUARDED = {"place_in", "press", "push", "strike", "wipe"}  # moves that end as something is felt
CONFIG = TasksConfig(seed=5, per_scene=5, two_literal_share=0.2, tries_of_kind=3)
CATEGORIES = ("brick", "carton", "tea box")  # a brick may be called a block


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root, out = tmp_path_factory.mktemp("bricks"), tmp_path_factory.mktemp("scenes")
    for number, category in enumerate(CATEGORIES):
        write_brick(root, number, category)
    layout = LayoutSettings(objects=(3, 3), upright=True, robot="panda", clutter="sparse")
    assert make_layouts(root, out, 1, LayoutsConfig(seed=1, layout=layout), executor="inline").exit_code == 0
    return out


@pytest.fixture(scope="module")
def folder(scenes: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("tasks")
    report, totals = make_tasks(scenes, out, CONFIG, executor="inline")
    assert report.exit_code == 0 and totals is not None
    return out


@pytest.fixture(scope="module")
def tasks(folder: Path) -> list[TaskRecord]:
    return read_tasks(folder)


@pytest.fixture(scope="module")
def episodes(folder: Path, tasks: list[TaskRecord], tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("episodes")
    assert make_episodes(folder, out, len(tasks), TrajectoriesConfig(seed=1), executor="inline").exit_code == 0
    collect(out, ["lerobot", "maniskill"])
    return out


@pytest.fixture(scope="module")
def kept(episodes: Path) -> list[StoredEpisode]:
    return list(stored_episodes(batch_folders(episodes)))


def test_tasks_are_of_several_kinds_and_each_is_said_in_words_that_fit_one_object(tasks: list[TaskRecord]) -> None:
    assert len({task.kind for task in tasks}) >= 4
    assert sum(len(task.steps) == 2 for task in tasks) == 1
    for task in tasks:
        assert len(task.instructions) >= 3 and not set(task.instructions) & set(task.held_out)
        for step in task.steps:
            assert step.target in task.objects
        stays = {literal.subject for literal in task.parsed_goal.stays}
        taking_part = {name for step in task.steps for name in (step.target, step.partner) if name}
        assert stays == set(task.objects) - taking_part


def test_the_report_counts_every_candidate_once(folder: Path, tasks: list[TaskRecord]) -> None:
    report = json.loads((folder / REPORT).read_bytes())
    assert report["tasks"] == len(tasks) == sum(report["kinds"].values())
    refused_early = ("does_not_fit", "true_already", "ambiguous_name", "carries_another", "out_of_reach", "no_grasp")
    later = sum(count for reason, count in report["dropped"].items() if reason not in refused_early)
    candidates = report["candidates"] + report["candidates_of_two_literals"]
    assert candidates == later + len(tasks)


def test_the_same_seed_gives_the_same_bytes_and_an_ended_run_is_left(
    scenes: Path, folder: Path, tmp_path: Path
) -> None:
    make_tasks(scenes, tmp_path, CONFIG, executor="inline")
    assert (tmp_path / TASKS).read_bytes() == (folder / TASKS).read_bytes()
    report, _ = make_tasks(scenes, tmp_path, CONFIG, executor="inline")
    assert any("were in the data set already" in remark for remark in report.remarks)
    with pytest.raises(UsageError, match="made with other settings"):
        make_tasks(scenes, tmp_path, CONFIG.model_copy(update={"seed": 4}), executor="inline")


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        ({"schema_version": 9}, "of schema 9"),
        ({"kind": "in"}, "that of its goal"),
        ({"surprise": 1}, "surprise"),
        ({"steps": []}, "steps"),
        ({"goal": {"literals": [{"predicate": "inn", "subject": "object_00"}]}}, "unknown predicate 'inn'"),
        ({"objects": {}}, "no object"),
        ({"seed": -1}, "seed"),
    ],
)
def test_a_file_that_is_none_of_tasks_is_refused_in_one_line(
    tasks: list[TaskRecord], tmp_path: Path, change: dict, cause: str
) -> None:
    said = tasks[0].model_dump(mode="json") | change
    (tmp_path / TASKS).write_text(json.dumps(said) + "\n")
    with pytest.raises(UsageError, match=cause) as refused:
        read_tasks(tmp_path)
    assert "\n" not in str(refused.value) and f"{TASKS}:1" in str(refused.value)


def test_files_of_tasks_are_read_as_they_were_written(tasks: list[TaskRecord], tmp_path: Path) -> None:
    path = tmp_path / TASKS
    path.write_bytes(tasks_bytes(tasks))
    assert read_tasks(path) == tasks
    path.write_bytes(tasks_bytes([tasks[0], tasks[0]]))
    with pytest.raises(UsageError, match="are repeated"):
        read_tasks(path)
    with pytest.raises(UsageError, match="no task 'nothing'"):
        path.write_bytes(tasks_bytes(tasks))
        one_task(tmp_path, "nothing")
    with pytest.raises(UsageError, match="not found"):
        read_tasks(tmp_path / "elsewhere")


def test_no_kind_is_too_frequent_and_two_literals_are_not_too_rare(tasks: list[TaskRecord]) -> None:
    single = [task for task in tasks if len(task.steps) == 1]
    double = next(task for task in tasks if len(task.steps) == 2)
    many = [task.model_copy(update={"task_id": str(n), "kind": "left_of"}) for n, task in enumerate(single[:1] * 20)]
    kept, dropped = balanced_tasks([*many, *single, double], 0.3, 0.2)
    assert sum(task.kind == "left_of" for task in kept) <= 0.3 * len(kept) + 1
    assert sum(len(task.steps) == 2 for task in kept) >= 0.2 * len(kept)
    assert dropped.total() == 21 + len(single) - len(kept)


def test_tasks_are_carried_out_with_their_goals_and_words(
    episodes: Path, tasks: list[TaskRecord], kept: list[StoredEpisode]
) -> None:
    attempts = {attempt.task_id: attempt for attempt in read_attempts(episodes / ATTEMPTS)}
    assert set(attempts) == {task.task_id for task in tasks}
    assert sum(attempt.outcome == "kept" for attempt in attempts.values()) >= len(tasks) - 1, attempts
    for task in tasks:
        attempt = attempts[task.task_id]
        assert attempt.instructions == task.instructions
        if attempt.goal is not None:
            assert attempt.goal == str(task.parsed_goal)
    for episode in kept:
        several = "+" in episode.attempt.skill
        numbers = episode.recording.active_literal
        assert (numbers is not None) == several
        if numbers is not None:
            assert numbers[0] == 0 and numbers[-1] == 1 and (np.diff(numbers.astype(int)) >= 0).all()


def test_a_skill_is_not_asked_of_tasks_which_say_themselves_what_is_done(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="skill is lift: tasks define their own skill"):
        make_episodes(folder, tmp_path / "out", 1, TrajectoriesConfig(skill="lift"), executor="inline")
    assert not (tmp_path / "out").exists()


def assert_same_state(seen: dict[str, np.ndarray], recording: Recording, number: int) -> None:
    """What is observed is what was recorded, to the last bit and to the signs of quaternions: a policy is trained on these."""
    objects = np.hstack([recording.object_positions_m[number], recording.object_quaternions_wxyz[number]])
    tip = np.append(recording.tip_position_m[number], recording.tip_quaternion_wxyz[number])
    np.testing.assert_array_equal(seen["object_poses"], objects)
    np.testing.assert_array_equal(seen["tip_pose"], tip)
    np.testing.assert_array_equal(seen["joint_positions_rad"], recording.joint_positions_rad[number])
    np.testing.assert_array_equal(seen["joint_velocities_rad_s"], recording.joint_velocities_rad_s[number])
    np.testing.assert_array_equal(seen["gripper_opening_m"], recording.hand[number])


def replayed(env: gymnasium.Env, episode: StoredEpisode, off_rad: float = 0.0) -> dict:
    """Give an episode's commands to an environment; ``off_rad`` turns the arm's base, else the states have to be the same."""
    recording, info = episode.recording, {}
    actions = np.column_stack([recording.action_joint_positions_rad, recording.action_gripper_opening_m])
    actions[:, 0] += off_rad
    assert_same_state(env.reset(seed=0)[0], recording, 0)
    for number, action in enumerate(actions, start=1):
        seen, reward, terminated, _, info = env.step(action)
        if not off_rad:
            assert_same_state(seen, recording, number)
        assert reward == float(info["success"])
        if terminated:
            break
    return info


def test_recorded_commands_reach_success_in_the_environment_and_wrong_ones_do_not(
    folder: Path, kept: list[StoredEpisode]
) -> None:
    double = [episode for episode in kept if "+" in episode.attempt.skill]
    guarded = [episode for episode in kept if GUARDED & set(episode.attempt.skill.split("+"))]
    assert guarded
    for episode in {each.attempt.episode_id: each for each in (*kept[:2], *double, *guarded)}.values():
        env = manitwin.make_env(folder, episode.attempt.task_id)
        assert replayed(env, episode)["success"], episode.attempt
        assert list(env.unwrapped.fixtures) == episode.facts.get("fixtures", [])
        if episode.attempt.skill == "push":
            place = env.unwrapped.places_m["mark"]
            ended_m = episode.recording.object_positions_m[-1, episode.recording.target]
            assert np.linalg.norm((ended_m - place)[:2]) < 0.03
        env.close()
    env = manitwin.make_env(folder, kept[0].attempt.task_id)
    missed = replayed(env, kept[0], off_rad=0.5)
    assert not missed["success"] and missed["failure"]
    env.close()


@pytest.mark.parametrize("rate_hz", [10, 5])
def test_commands_of_a_lower_rate_reach_success_in_an_environment_of_that_rate(
    folder: Path, kept: list[StoredEpisode], rate_hz: int
) -> None:
    recording = downsample(kept[0].recording, rate_hz)
    env = manitwin.make_env(folder, kept[0].attempt.task_id, rate_hz=rate_hz)
    assert env.metadata["render_fps"] == rate_hz
    env.reset(seed=0)
    for told, hand in zip(recording.action_joint_positions_rad, recording.action_hand, strict=True):
        _, _, terminated, _, info = env.step(np.append(told, hand))
        if terminated:
            break
    assert info["success"], info
    env.close()


@pytest.mark.filterwarnings("ignore:.*symmetric and normalized")  # joints in rad are what recordings have
def test_the_environment_passes_gymnasiums_checker(folder: Path, tasks: list[TaskRecord]) -> None:
    env = manitwin.make_env(folder, tasks[0].task_id, max_steps=5)
    check_env(env, skip_render_check=True)
    _, info = env.reset(seed=1)
    assert not info["success"]
    home = np.append(env.unwrapped._robot.home_rad, 0.08).astype(np.float32)
    ends = [env.step(home)[2:4] for _ in range(5)]
    assert ends == [(False, False)] * 4 + [(False, True)]
    env.close()


@pytest.mark.slow
def test_the_environment_shows_pictures_of_what_is_there(folder: Path, tasks: list[TaskRecord]) -> None:
    env = manitwin.make_env(folder, tasks[0].task_id, cameras=("front", "wrist"), picture_px=32)
    first, _ = env.reset(seed=0)
    assert env.observation_space.contains(first) and set(first["pictures"]) == {"front", "wrist"}
    assert all(picture.std() > 5 for picture in first["pictures"].values())
    told = env.unwrapped.cameras
    assert {name: each["camera.frame"] for name, each in told.items()} == {"front": "world", "wrist": "tip"}
    assert told["front"]["camera.intrinsics_px"][0][2] == 16
    turned = np.append(env.unwrapped._robot.home_rad, 0.08).astype(np.float32)
    turned[0] += 0.3
    for _ in range(10):
        then, *_ = env.step(turned)
    assert all((then["pictures"][name] != picture).any() for name, picture in first["pictures"].items())
    assert np.array_equal(env.render(), then["pictures"]["front"])
    env.close()
    with pytest.raises(UsageError, match="reset after close; make the environment again"):
        env.reset(seed=0)


def test_bddl_says_what_it_can_and_lists_the_rest(scenes: Path, tasks: list[TaskRecord]) -> None:
    scene = read_scene(scene_files(scenes)[0])
    for task in tasks:
        goal = task.parsed_goal
        said = bddl_of(task, scene)
        sayable = all(literal.predicate in ("on", "in") for literal in goal.literals)
        assert (said.text is not None) == sayable
        if said.text is not None:
            first = goal.literals[0]
            assert f"(And ({first.predicate.capitalize()} {first.subject} {first.second})" in said.text
            assert said.text.count("(") == said.text.count(")")
            assert said.left_out == tuple(f"{stay} throughout" for stay in goal.stays)
        else:
            assert said.left_out


def test_a_model_proposes_literals_and_what_cannot_be_is_counted(
    scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def literal(predicate: str, a: str, b: str) -> dict:
        return {"predicate": predicate, "a": a, "b": b}

    def answer(name: str, schema: dict, text: str, pictures: list[bytes]) -> dict:
        assert name == "task_proposals" and "object_00: " in text
        first = literal("near", "object_00", "object_01")
        return {
            "tasks": [
                {"instruction": "bring them together", "literals": [first]},
                {"instruction": "put it in the carton", "literals": [literal("in", "object_00", "object_01")]},
                {"instruction": "both", "literals": [first, literal("left_of", "object_01", "object_02")]},
                {"instruction": "nothing", "literals": []},
            ]
        }

    monkeypatch.setenv("MANITWIN_VLM_KEY", "rehearsal-key")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    with FakeServer(FakeOpenAi(answer=answer)) as server:
        config = CONFIG.model_copy(update={"per_scene": 1, "vlm": f"openai:any@{server.url}/v1"})
        _, totals = make_tasks(scenes, tmp_path / "out", config, executor="inline")
    assert totals is not None
    assert totals.dropped["proposed_impossible"] == 1
    assert totals.dropped["proposed_undoes_first"] == 1
    assert totals.dropped["proposed_wrong_number_of_literals"] == 1
    assert any(task.source == "proposed" for task in read_tasks(tmp_path / "out"))
