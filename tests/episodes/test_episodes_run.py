"""Whole runs: bricks on a table are picked and placed, recorded, collected, and resumed."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from grasped_twins import write_brick
from manitwin.engine.stage import StagePart, progress_listener
from manitwin.episodes.attempts import ATTEMPTS, read_attempts
from manitwin.episodes.cameras import named_cameras
from manitwin.episodes.collect import batch_folders, collect, stored_episodes
from manitwin.episodes.episode_pictures import render_batches, write_with_pictures
from manitwin.episodes.episodes_run import make_episodes
from manitwin.episodes.episodes_stage import EPISODES, EpisodesStage
from manitwin.episodes.lerobot.read import read_lerobot
from manitwin.episodes.planning.problem import Phase
from manitwin.episodes.settings import PicturesConfig, TrajectoriesConfig
from manitwin.episodes.statistics.report import episode_statistics
from manitwin.errors import EpisodesError, UsageError
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.robots.load import load_robot
from manitwin.scenes.layouts.layouts_run import make_layouts
from manitwin.scenes.settings import LayoutsConfig, LayoutSettings

CONFIG = TrajectoriesConfig(seed=5, batch=2)


@pytest.fixture(scope="module")
def bricks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("bricks")
    for number in range(3):
        write_brick(root, number, ("brick", "block", "tea box")[number])
    return root


@pytest.fixture(scope="module")
def episodes(bricks: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("episodes")
    report = make_episodes(bricks, out, 6, CONFIG, executor="inline")
    assert report.exit_code == 0
    collect(out, ["lerobot", "maniskill"])
    return out


def test_bricks_are_put_where_they_should_be(episodes: Path) -> None:
    attempts = list(read_attempts(episodes / ATTEMPTS))
    assert len(attempts) == 6
    assert sum(attempt.outcome == "kept" for attempt in attempts) >= 5
    for episode in stored_episodes(batch_folders(episodes)):
        goal, recording = np.array(episode.facts["goal_object_to_world"]), episode.recording
        last = recording.object_positions_m[-1, recording.target]
        assert np.linalg.norm(last[:2] - goal[:2, 3]) < 0.01
        turned = rotation_from_quaternion_wxyz(recording.object_quaternions_wxyz[-1, recording.target].astype(float))
        assert (turned @ goal[:3, :3].T)[2, 2] > np.cos(np.radians(3))
        assert episode.attempt.position_error_m == pytest.approx(np.linalg.norm(last - goal[:3, 3]), abs=0.005)


def test_a_recording_tells_a_pick_and_place_in_order(episodes: Path) -> None:
    episode = next(stored_episodes(batch_folders(episodes)))
    recording = episode.recording
    phases = recording.phase.tolist()
    assert phases == sorted(phases)
    assert {Phase.REACH, Phase.CLOSE, Phase.CARRY, Phase.OPEN, Phase.RETREAT} <= set(phases)
    carried = np.flatnonzero(recording.phase == Phase.CARRY)
    assert (recording.object_positions_m[carried, recording.target, 2] > 0.03).all()
    assert not recording.target_on_support[carried].any()
    assert recording.finger_forces_n[carried].min() > 10
    assert not recording.unplanned_contact.any()


def test_the_same_seed_gives_the_same_bytes_and_each_attempt_is_told(
    bricks: Path, episodes: Path, tmp_path: Path
) -> None:
    told: list[StagePart] = []
    with progress_listener(told.append):
        make_episodes(bricks, tmp_path, 6, CONFIG, executor="inline")
    assert told == [StagePart(done, 2, "episodes") for _ in range(3) for done in (1, 2)]
    names = [folder.name for folder in batch_folders(episodes)]
    assert [folder.name for folder in batch_folders(tmp_path)] == names
    for one, other in zip(batch_folders(episodes), batch_folders(tmp_path), strict=True):
        for name in (EPISODES, ATTEMPTS, "batch.json"):
            assert (one / name).read_bytes() == (other / name).read_bytes(), name


def test_a_second_run_does_nothing_and_more_episodes_are_added(bricks: Path, episodes: Path, tmp_path: Path) -> None:
    make_episodes(bricks, tmp_path, 3, CONFIG, executor="inline")
    before = {folder.name: (folder / "batch.json").stat().st_mtime_ns for folder in batch_folders(tmp_path)}
    opened: list[int] = []
    make_episodes(bricks, tmp_path, 3, CONFIG, executor="inline", on_start=lambda items, todo: opened.append(todo))
    assert opened == [0]
    assert {f.name: (f / "batch.json").stat().st_mtime_ns for f in batch_folders(tmp_path)} == before


def test_the_collected_sets_hold_what_was_kept(episodes: Path) -> None:
    kept = sum(attempt.outcome == "kept" for attempt in read_attempts(episodes / ATTEMPTS))
    assert len(read_lerobot(episodes / "lerobot").episodes) == kept
    merged = json.loads((episodes / "maniskill" / "trajectory.json").read_text())
    assert len(merged["episodes"]) == kept
    assert pq.read_metadata(episodes / ATTEMPTS).num_rows == 6


def test_scenes_give_episodes_too(bricks: Path, tmp_path: Path) -> None:
    layouts = LayoutsConfig(seed=2, layout=LayoutSettings(objects=(2, 3), robot="panda"))
    assert make_layouts(bricks, tmp_path / "scenes", 2, layouts, executor="inline").exit_code == 0
    report = make_episodes(tmp_path / "scenes", tmp_path / "episodes", 2, CONFIG, executor="inline")
    assert report.exit_code == 0
    attempts = [
        attempt for folder in batch_folders(tmp_path / "episodes") for attempt in read_attempts(folder / ATTEMPTS)
    ]
    assert {attempt.scene_id for attempt in attempts} == {"layout_2_000000", "layout_2_000001"}
    assert all(attempt.others >= 1 for attempt in attempts)
    assert any(attempt.succeeded for attempt in attempts)
    # those of twins alone would open the batches of scenes again, and have none
    with pytest.raises(UsageError, match=r"its episodes are of .*scenes; give another folder for those of"):
        make_episodes(bricks, tmp_path / "episodes", 2, CONFIG, executor="inline")


def test_other_objects_are_not_promised_where_scenes_have_their_own(bricks: Path, tmp_path: Path) -> None:
    layouts = LayoutsConfig(seed=2, layout=LayoutSettings(objects=(2, 2), robot="panda"))
    assert make_layouts(bricks, tmp_path / "scenes", 1, layouts, executor="inline").exit_code == 0
    with pytest.raises(UsageError, match="others is 3: scenes have their own objects"):
        make_episodes(tmp_path / "scenes", tmp_path / "out", 1, TrajectoriesConfig(others=3), executor="inline")
    assert not (tmp_path / "out").exists()


def test_twins_without_a_grasp_for_the_hand_are_said_before_anything_is_made(bricks: Path, tmp_path: Path) -> None:
    config = TrajectoriesConfig(seed=5, robot="ur5_suction")
    with pytest.raises(UsageError, match="none of 3 twins has a verified grasp for suction, the hand of ur5_suction"):
        make_episodes(bricks, tmp_path, 2, config, executor="inline")
    assert not list(tmp_path.iterdir())


def test_what_became_of_twins_without_a_grasp_is_told_at_the_end(bricks: Path, tmp_path: Path) -> None:
    scenes = tmp_path / "scenes"
    layout = LayoutSettings(objects=(1, 1), robot="ur5_suction")
    make_layouts(bricks, scenes, 1, LayoutsConfig(seed=3, layout=layout), executor="inline")
    out = tmp_path / "episodes"
    make_episodes(scenes, out, 1, TrajectoriesConfig(seed=5, robot="ur5_suction"), executor="inline")
    told = "\n".join(collect(out, ["maniskill"]).lines)
    assert "not kept: 1 no_grasp\nwhy no_grasp: there is no verified grasp for the robot's hand for " in told
    assert "manitwin build --gripper" in told


def test_what_is_no_place_of_twins_is_said(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no accepted twin"):
        make_episodes(tmp_path, tmp_path / "out", 1, CONFIG, executor="inline")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_skill_that_no_pair_of_twins_suits_is_said_before_anything_is_made(bricks: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"none of \d+ twins can be used to place_in"):
        make_episodes(bricks, tmp_path, 1, TrajectoriesConfig(skill="place_in"), executor="inline")
    assert not list(tmp_path.glob("batches/*"))


def test_pictures_are_drawn_afterwards_and_join_the_set(bricks: Path, tmp_path: Path) -> None:
    make_episodes(bricks, tmp_path, 2, CONFIG, executor="inline")
    config = PicturesConfig(cameras=("front", "wrist"), size_px=64, rate_hz=10)
    assert render_batches(tmp_path, config, executor="inline").exit_code == 0
    opened: list[int] = []
    render_batches(tmp_path, config, executor="inline", on_start=lambda items, todo: opened.append(todo))
    assert opened == [0]
    written = write_with_pictures(tmp_path, config.cameras, config.rate_hz)
    loaded = read_lerobot(tmp_path / "lerobot", decode_videos=True)
    assert written.episodes == len(loaded.episodes) == 2
    for camera in named_cameras(config.cameras, load_robot("panda")):
        told = loaded.info["features"][f"observation.images.{camera.name}"]["info"]
        assert told.items() >= camera.to_json(64, 64).items()
    assert loaded.info["fps"] == 10
    assert written.frames == sum(e.recording.steps // 2 for e in stored_episodes(batch_folders(tmp_path)))


def test_statistics_of_a_run_name_what_was_kept(episodes: Path) -> None:
    report = episode_statistics(episodes)
    assert report.summary.startswith("6 episodes attempted")
    assert report.write(episodes / "statistics").is_file()


def test_folders_without_episodes_are_said(tmp_path: Path) -> None:
    with pytest.raises(EpisodesError, match="manitwin trajectories"):
        render_batches(tmp_path, PicturesConfig(), executor="inline")
    with pytest.raises(UsageError, match="manitwin trajectories"):
        collect(tmp_path, ["lerobot"])


def test_episodes_made_in_steps_are_those_made_in_one_go(bricks: Path, episodes: Path, tmp_path: Path) -> None:
    totals = []
    for count in (2, 4, 6):
        report = make_episodes(bricks, tmp_path, count, CONFIG, executor="inline")
        totals.append(collect(tmp_path, ["lerobot"]).totals.attempted)
    assert totals == [2, 4, 6]
    assert report.remarks == ["4 of 6 episodes existed already"]
    in_steps, in_one_go = (
        {(each.seed, each.twin_id, each.grasp_id, each.length_s) for each in read_attempts(out / ATTEMPTS)}
        for out in (tmp_path, episodes)
    )
    assert in_steps == in_one_go
    assert len(in_steps) == 6
    actions = [each.recording.object_positions_m.tobytes() for each in stored_episodes(batch_folders(tmp_path))]
    assert len(set(actions)) == len(actions)
    opened: list[int] = []
    fewer = make_episodes(
        bricks, tmp_path, 3, CONFIG, executor="inline", on_start=lambda items, todo: opened.append(todo)
    )
    assert opened == [0]
    assert fewer.remarks == ["6 episodes exist already, more than the requested 3; none was added"]
    with pytest.raises(UsageError, match=r"made with other settings \(seed: 5 there, 6 now\).*another folder"):
        make_episodes(bricks, tmp_path, 6, CONFIG.model_copy(update={"seed": 6}), executor="inline")


def test_batches_that_repeat_an_episode_are_refused(episodes: Path, tmp_path: Path) -> None:
    shutil.copytree(episodes, tmp_path / "copy")
    folder = batch_folders(tmp_path / "copy")[0]
    shutil.copytree(folder, folder.parent / f"{folder.name[:2]}{'0' * 14}")
    with pytest.raises(EpisodesError, match=r"repeats episode 00000000 of .*make the episodes again in a new folder"):
        collect(tmp_path / "copy", ["lerobot"])


@pytest.mark.parametrize("count", [3, 4])
def test_episodes_that_another_version_made_stay_and_the_run_says_so(
    count: int, bricks: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as earlier:
        earlier.setattr(EpisodesStage, "version", "of an earlier version")
        make_episodes(bricks, tmp_path, 3, CONFIG, executor="inline")
    before = {folder.name: (folder / "batch.json").read_bytes() for folder in batch_folders(tmp_path)}
    opened: list[int] = []
    report = make_episodes(
        bricks, tmp_path, count, CONFIG, executor="inline", on_start=lambda items, todo: opened.append(todo)
    )
    assert opened == [count - 3] and report.exit_code == 0
    after = {folder.name: (folder / "batch.json").read_bytes() for folder in batch_folders(tmp_path)}
    assert {name: after[name] for name in before} == before
    assert any("were made by another version" in said and "new folder" in said for said in report.remarks)
    assert f"3 of {count} episodes existed already" in report.remarks


def test_a_batch_of_a_newer_version_is_refused(episodes: Path, tmp_path: Path) -> None:
    shutil.copytree(episodes, tmp_path / "newer")
    record = batch_folders(tmp_path / "newer")[0] / "batch.json"
    record.write_text(json.dumps({**json.loads(record.read_text()), "schema_version": 2, "weather": "fine"}))
    with pytest.raises(
        EpisodesError, match=r"batch\.json: of schema 2, this version reads up to 1; use the version that"
    ):
        collect(tmp_path / "newer", [])


def test_episodes_of_a_version_that_recorded_less_are_refused_before_more_are_made(
    bricks: Path, episodes: Path, tmp_path: Path
) -> None:
    out = tmp_path / "earlier"
    shutil.copytree(episodes, out)
    for table in out.glob(f"batches/*/*/{ATTEMPTS}"):
        pq.write_table(pq.read_table(table).drop_columns(["goal"]), table)
    with pytest.raises(EpisodesError, match="has no column goal; make the episodes again in a new folder"):
        make_episodes(bricks, out, 8, CONFIG, executor="inline")
    assert len(list(out.glob("batches/*/*/batch.json"))) == len(batch_folders(episodes))
