"""Starts that vary with the seed: drawn where asked for, the same for the same seed, and clear of all that stands around."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import manitwin
from grasped_twins import write_brick
from manitwin.episodes.environment import start_noise
from manitwin.episodes.environment.environment import TaskEnvironment
from manitwin.episodes.environment.start_noise import draw_start
from manitwin.episodes.pick_place_tasks import footprint_at
from manitwin.episodes.planning.problem import PickPlaceProblem
from manitwin.episodes.settings import TasksConfig
from manitwin.episodes.tasks.tasks_run import make_tasks
from manitwin.errors import UsageError
from manitwin.geometry.boxes import separation_m
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.scenes.layouts.layouts_run import make_layouts
from manitwin.scenes.layouts.placing import Obstacles
from manitwin.scenes.scene_files import read_scene, scene_files
from manitwin.scenes.settings import LayoutsConfig, LayoutSettings

SMALL = manitwin.StartNoise(joints_rad=0.02, position_m=0.01, yaw_rad=0.1)
WIDE = manitwin.StartNoise(position_m=0.3, yaw_rad=3.0)
CARRYING, CARRIED = 0, 3  # of the scene's four bricks the last one stands on the first
CATEGORIES = ("brick", "block", "tea box", "carton")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("bricks")
    for number, category in enumerate(CATEGORIES):
        write_brick(root, number, category)
    layout = LayoutSettings(objects=(4, 4), stacked=1, upright=True, robot="panda", clutter="sparse")
    assert make_layouts(root, root / "s", 1, LayoutsConfig(seed=1, layout=layout), executor="inline").exit_code == 0
    config = TasksConfig(seed=3, per_scene=1, two_literal_share=0.0, tries_of_kind=3)
    assert make_tasks(root / "s", root / "tasks", config, executor="inline")[0].exit_code == 0
    objects = read_scene(scene_files(root / "s")[0]).objects
    assert [each.supported_by for each in objects] == [None, None, None, objects[CARRYING].name]
    return root / "tasks"


def environment(folder: Path, noise: manitwin.StartNoise | None) -> TaskEnvironment:
    return manitwin.make_env(folder, start_noise=noise, max_steps=5)


def test_start_is_what_was_drawn_and_that_of_its_seed(folder: Path) -> None:
    plain, env = environment(folder, None), environment(folder, SMALL)
    before, info = plain.reset(seed=0)
    assert "start_noise" not in info
    seen = [env.reset(seed=seed) for seed in (7, 8, 7)]
    for name, value in seen[0][0].items():
        assert value.tobytes() == seen[2][0][name].tobytes()
    for observation, info in seen[:2]:
        drawn = info["start_noise"]
        joints_rad = before["joint_positions_rad"] + drawn["joint_offsets_rad"]
        np.testing.assert_allclose(observation["joint_positions_rad"], joints_rad, atol=1e-5)
        moves = drawn["object_moves"]
        assert not moves[[CARRYING, CARRIED]].any() and moves[1:3].all()
        assert (np.abs(moves) <= [SMALL.position_m, SMALL.position_m, SMALL.yaw_rad]).all()
        here, there = before["object_poses"], observation["object_poses"]
        # the bricks' centres of mass are above their origins
        np.testing.assert_allclose(there[:, :2] - here[:, :2], moves[:, :2], atol=1e-4)
        np.testing.assert_allclose(there[:, 2], here[:, 2], atol=1e-4)
        for was, now, (_, _, yaw_rad) in zip(here, there, moves, strict=True):
            turn = rotation_from_quaternion_wxyz(now[3:]) @ rotation_from_quaternion_wxyz(was[3:]).T
            assert np.arctan2(turn[1, 0], turn[0, 0]) == pytest.approx(yaw_rad, abs=1e-3)
    assert np.abs(seen[0][0]["joint_positions_rad"] - seen[1][0]["joint_positions_rad"]).min() > 0
    again, _ = env.reset()
    assert not np.array_equal(again["joint_positions_rad"], seen[2][0]["joint_positions_rad"])
    plain.close()
    env.close()


def test_tip_has_the_sign_that_it_has_at_home_wherever_it_starts(folder: Path) -> None:
    plain, env = environment(folder, None), environment(folder, manitwin.StartNoise(joints_rad=0.1))
    home = plain.reset(seed=0)[0]["tip_pose"][3:]
    for seed in range(12):  # the hand looks down at home, where w is next to 0
        assert env.reset(seed=seed)[0]["tip_pose"][3:] @ home > 0.9
    plain.close()
    env.close()


def test_arm_stays_where_it_was_drawn(folder: Path) -> None:
    env = environment(folder, SMALL)
    first, info = env.reset(seed=1)
    home = np.array(env.unwrapped._robot.home_rad) + info["start_noise"]["joint_offsets_rad"]
    then, *_ = env.step(np.append(home, 0.08).astype(np.float32))
    np.testing.assert_allclose(then["joint_positions_rad"], first["joint_positions_rad"], atol=1e-4)
    env.close()


def test_without_noise_every_seed_gives_the_same_bytes_and_noise_of_nothing_changes_none(folder: Path) -> None:
    seen = []
    for noise, seed in ((None, 0), (None, 1), (manitwin.StartNoise(), 2)):
        env = environment(folder, noise)
        observation, _ = env.reset(seed=seed)
        seen.append({name: value.tobytes() for name, value in observation.items()})
        env.close()
    assert seen[0] == seen[1] == seen[2]


@pytest.mark.filterwarnings("ignore:.*symmetric and normalized")  # joints in rad are what recordings have
def test_environment_with_noise_passes_gymnasiums_checker(folder: Path) -> None:
    env = environment(folder, SMALL)
    check_env(env, skip_render_check=True)
    env.close()


def drawn_problems(env: TaskEnvironment, count: int = 30) -> list[PickPlaceProblem]:
    rng = np.random.default_rng(0)
    return [draw_start(WIDE, env._setting, env._planner, rng).problem for _ in range(count)]


def overlapping(problem: PickPlaceProblem) -> int:
    """Return how many pairs of footprints overlap, of those that no brick stands on."""
    names = {f"object_{number:02d}" for number in range(len(CATEGORIES)) if number != CARRIED}
    stand = [each for each in (problem.target, *problem.obstacles) if each.name in names]
    feet = [footprint_at(each.body, each.object_to_world) for each in stand]
    return sum(separation_m(a, b) <= 0 for a, b in combinations(feet, 2))


def test_drawn_objects_stay_clear_of_each_other_on_their_surface_and_in_reach(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    env = environment(folder, WIDE)
    (support,) = env._setting.scene.scene.record.furniture.supports
    workspace = env._robot.workspace
    for problem in drawn_problems(env):
        assert not overlapping(problem)
        for each in (problem.target, *problem.obstacles):
            corners = footprint_at(each.body, each.object_to_world)
            assert (np.abs(corners - support.center_m) <= support.half_extents_m).all()
            radius_m = np.hypot(*each.object_to_world[:2, 3])
            assert workspace.min_radius_m <= radius_m <= workspace.max_radius_m
    monkeypatch.setattr(Obstacles, "is_clear", lambda *_: True)
    assert any(overlapping(problem) for problem in drawn_problems(env)), (
        "these draws overlap where nothing refuses them"
    )


def test_no_free_place_and_no_free_arm_are_usage_errors(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    env = environment(folder, SMALL)
    monkeypatch.setattr(start_noise, "LEAST_GAP_M", 5.0)
    with pytest.raises(UsageError, match=r"no free place for object_01 of task \w+ in 200 draws") as refused:
        env.reset(seed=0)
    assert "\n" not in str(refused.value)
    monkeypatch.undo()
    monkeypatch.setattr(env._planner.arm, "upper", env._planner.arm.lower)
    with pytest.raises(UsageError, match="no free position of the arm in 200 draws"):
        env.reset(seed=0)


@pytest.mark.parametrize("name", ["joints_rad", "position_m", "yaw_rad"])
@pytest.mark.parametrize("value", [-0.01, float("nan"), float("inf"), 3.2, "0.1", True, None])
def test_noise_that_is_no_sensible_number_is_refused(name: str, value: object) -> None:
    with pytest.raises(UsageError, match=f"start_noise: {name} is") as refused:
        manitwin.StartNoise(**{name: value})
    assert "\n" not in str(refused.value)


def test_noise_of_another_type_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"give a manitwin\.StartNoise"):
        manitwin.make_env(tmp_path, start_noise=0.02)  # type: ignore[arg-type]
