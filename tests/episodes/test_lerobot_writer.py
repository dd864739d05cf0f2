"""What is in a LeRobotDataset that was written: frames, tasks, statistics, videos, and the same bytes again."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pyarrow.parquet as pq
import pytest
from lerobot_sets import HEIGHT_PX, WIDTH_PX, camera, color_rgb, episodes, written
from synthetic_episodes import episode, robot, with_granules

from manitwin.episodes.hdf5_file import write_episodes
from manitwin.episodes.lerobot.read import LeRobotSet, read_lerobot
from manitwin.episodes.lerobot.videos import CameraVideos, Clip
from manitwin.episodes.lerobot.write import write_lerobot
from manitwin.episodes.recording import joint_delta, tip_delta
from manitwin.errors import EpisodesError
from manitwin.twin.store import digests_below


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("set") / "lerobot"
    written(place)
    return place


@pytest.fixture(scope="module")
def found(root: Path) -> LeRobotSet:
    return read_lerobot(root)


def test_frames_are_those_of_the_recordings(found: LeRobotSet) -> None:
    begin = 0
    for number, given in enumerate(episodes()):
        frames, taken = found.frames(number), given.recording
        steps = taken.steps
        assert np.array_equal(frames["observation.state"][:, :-1], taken.joint_positions_rad[:-1])
        assert np.array_equal(frames["observation.state"][:, -1], taken.gripper_opening_m[:-1])
        assert np.array_equal(frames["observation.velocity"], taken.joint_velocities_rad_s[:-1])
        assert np.array_equal(frames["observation.tip_pose"][:, :3], taken.tip_position_m[:-1])
        assert np.array_equal(frames["observation.tip_pose"][:, 3:], taken.tip_quaternion_wxyz[:-1])
        assert np.array_equal(frames["observation.target_pose"][:, :3], taken.object_positions_m[:-1, taken.target])
        assert np.array_equal(frames["action"][:, :-1], taken.action_joint_positions_rad)
        assert np.array_equal(frames["action"][:, -1], taken.action_gripper_opening_m)
        assert np.array_equal(frames["action.joint_delta"], joint_delta(taken))
        assert np.array_equal(frames["action.tip_delta"], tip_delta(taken))
        assert np.array_equal(frames["phase"], taken.phase)
        assert frames["next.done"].tolist() == frames["next.success"].tolist() == [False] * (steps - 1) + [True]
        assert np.allclose(frames["timestamp"], np.arange(steps) / 20, atol=1e-6)
        assert np.array_equal(frames["index"], np.arange(begin, begin + steps))
        begin += steps
    assert found.info["total_frames"] == begin


def test_frames_tell_which_literal_of_a_goal_is_worked_on(found: LeRobotSet, tmp_path: Path) -> None:
    assert not found.frames(0)["active_literal"].any()
    two = episode(0)
    numbers = (np.arange(two.recording.steps) > 3).astype(np.uint8)
    two = replace(two, recording=replace(two.recording, active_literal=numbers))
    write_lerobot([two], tmp_path / "set")
    assert np.array_equal(read_lerobot(tmp_path / "set").frames(0)["active_literal"], numbers)


def test_pose_of_what_is_moved_is_that_of_what_is_handled_of_a_goal_of_several_literals(tmp_path: Path) -> None:
    given = episode(0)
    first, second = given.objects[1].name, given.objects[0].name
    numbers = (np.arange(given.recording.steps) > 3).astype(np.uint8)
    two = replace(
        given,
        attempt=replace(given.attempt, goal=f"near({first}, {second}, 0.1) and lifted({second}, 0.1)"),
        recording=replace(given.recording, active_literal=numbers, target=0),
    )
    write_lerobot([two], tmp_path / "set")
    told = read_lerobot(tmp_path / "set").frames(0)["observation.target_pose"][:, :3]
    assert np.array_equal(told[:4], two.recording.object_positions_m[:4, 1])
    assert np.array_equal(told[4:], two.recording.object_positions_m[4:-1, 0])
    write_episodes(tmp_path / "episodes.h5", [two])
    with h5py.File(tmp_path / "episodes.h5") as file:
        assert np.array_equal(file["traj_0/obs/extra/obj_pose"][:-1, :3], told)


def test_frames_count_granules_where_a_set_has_them(found: LeRobotSet, tmp_path: Path) -> None:
    assert "observation.granules" not in found.features
    write_lerobot([episode(0), with_granules(episode(1))], tmp_path / "set", granules=True)
    counted = read_lerobot(tmp_path / "set")
    assert counted.features["observation.granules"]["names"] == ["in_target", "in_others", "in_none"]
    assert not counted.frames(0)["observation.granules"].any()
    counts = counted.frames(1)["observation.granules"]
    assert counts[:3].tolist() == [[9, 0, 0], [8, 1, 0], [7, 2, 0]]
    assert counts[-1].tolist() == [0, 8, 1]


def test_features_are_named_and_typed(found: LeRobotSet) -> None:
    assert found.features["observation.state"] == {
        "dtype": "float32",
        "shape": [8],
        "names": [*(f"panda_joint{i + 1}" for i in range(7)), "gripper_opening_m"],
    }
    assert found.features["action"]["names"] == found.features["observation.state"]["names"]
    assert found.features["next.success"] == {"dtype": "bool", "shape": [1], "names": None}
    assert (found.info["robot_type"], found.info["fps"], found.info["video_path"]) == ("panda", 20, None)


@pytest.mark.slow
def test_every_instruction_is_a_task_and_frames_have_one_of_their_own(found: LeRobotSet, tmp_path: Path) -> None:
    given = episodes()
    assert set(found.tasks) == {task for one in given for task in one.attempt.instructions}
    for number, one in enumerate(given):
        assert found.episodes[number]["tasks"] == list(one.attempt.instructions)
        (index,) = set(found.frames(number)["task_index"].tolist())
        assert found.tasks[index] in one.attempt.instructions
    many = [episode(i, steps=2) for i in range(60)]
    chosen = []
    for seed in (0, 1):
        write_lerobot(many, tmp_path / str(seed), seed=seed)
        read = read_lerobot(tmp_path / str(seed))
        chosen.append(
            [many[i].attempt.instructions.index(read.tasks[read.frames(i)["task_index"][0]]) for i in range(60)]
        )
    assert chosen[0] != chosen[1]
    assert min(np.bincount(chosen[0], minlength=3)) > 8  # of 60, each of three phrasings is expected 20 times


def test_episode_rows_say_what_the_episode_is_of(found: LeRobotSet) -> None:
    for row, one in zip(found.episodes, episodes(), strict=True):
        for name in ("episode_id", "twin_id", "grasp_id", "scene_id", "seed", "robot", "category", "position_error_m"):
            assert row[name] == getattr(one.attempt, name)


def test_statistics_of_the_set_are_those_of_all_frames(found: LeRobotSet, root: Path) -> None:
    stats = json.loads((root / "meta/stats.json").read_text())
    frames = [found.frames(i) for i in range(5)]
    for name in found.features:
        values = np.concatenate([f[name] for f in frames]).astype(float).reshape(-1, found.features[name]["shape"][0])
        told = {kind: np.array(value) for kind, value in stats[name].items()}
        assert np.array_equal(told["min"], values.min(0)) and np.array_equal(told["max"], values.max(0))
        assert np.allclose(told["mean"], values.mean(0)) and np.allclose(told["std"], values.std(0), atol=1e-9)
        assert told["count"] == [len(values)]
        step = (values.max(0) - values.min(0)) / 5000
        for kind, share in (("q01", 0.01), ("q10", 0.1), ("q50", 0.5), ("q90", 0.9), ("q99", 0.99)):
            # between the ordered values beside the wanted rank, up to a step of the histogram
            ordered = np.sort(values, axis=0)
            rank = share * len(values)
            low = ordered[max(int(np.floor(rank)) - 1, 0)] - step - 1e-9
            high = ordered[min(int(np.ceil(rank)), len(values) - 1)] + step + 1e-9
            assert ((low <= told[kind]) & (told[kind] <= high)).all(), (name, kind)


def test_one_row_group_an_episode_and_files_of_limited_size(tmp_path: Path) -> None:
    many = [episode(i, steps=400) for i in range(40)]
    write_lerobot(many, tmp_path / "set", data_files_size_in_mb=1)
    files = sorted((tmp_path / "set/data/chunk-000").iterdir())
    assert len(files) > 2
    assert all(path.stat().st_size <= (1 << 20) + 20_000 for path in files)  # the footer comes on top
    assert sum(pq.ParquetFile(path).metadata.num_row_groups for path in files) == 40
    found = read_lerobot(tmp_path / "set")
    assert {row["data/file_index"] for row in found.episodes} == set(range(len(files)))
    assert np.array_equal(found.frames(39)["action"][:, :-1], many[39].recording.action_joint_positions_rad)


def test_same_episodes_give_the_same_bytes_and_replace_an_older_set(tmp_path: Path) -> None:
    clips = camera(tmp_path / "pictures", episodes(3))
    written(tmp_path / "a", 5)
    written(tmp_path / "a", 3, videos=[clips])
    written(tmp_path / "b", 3, videos=[clips])
    assert digests_below(tmp_path / "a") == digests_below(tmp_path / "b")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "b", "pictures"]


def test_one_episode_of_one_task_and_one_frame_is_a_set(tmp_path: Path) -> None:
    only = episode(0, steps=1)
    only = replace(only, attempt=replace(only.attempt, instructions=("pick it up",)))
    assert write_lerobot([only], tmp_path / "set").frames == 1
    assert read_lerobot(tmp_path / "set").tasks == ("pick it up",)


def test_videos_are_where_the_rows_say(tmp_path: Path) -> None:
    given = episodes(5)
    cameras = [
        camera(tmp_path / "pictures", given),
        camera(tmp_path / "pictures", given, "wrist", "mpeg4"),
        camera(tmp_path / "pictures", given, "side", "vp9"),
    ]
    write_lerobot(given, tmp_path / "set", videos=cameras)
    found = read_lerobot(tmp_path / "set", decode_videos=True)
    key = "observation.images.front"
    assert found.features[key]["shape"] == [HEIGHT_PX, WIDTH_PX, 3]
    infos = [found.features[f"observation.images.{name}"]["info"] for name in ("front", "wrist", "side")]
    assert [info["camera.codec"] for info in infos] == ["av1", "mpeg4", "vp9"]
    assert [info.get("video.codec") for info in infos] == ["av1", None, None], (
        "LeRobot 0.6 encodes with what stands there"
    )
    assert [row[f"videos/{key}/file_index"] for row in found.episodes] == [0, 0, 1, 1, 2]
    second = found.episodes[1]
    assert second[f"videos/{key}/from_timestamp"] == pytest.approx((given[0].recording.steps + 1) / 20)
    stats = json.loads((tmp_path / "set/meta/stats.json").read_text())[key]
    assert np.array(stats["mean"]).shape == (3, 1, 1)
    rows = pq.read_table(tmp_path / "set/meta/episodes/chunk-000/file-000.parquet")
    dark = np.array(rows[f"stats/{key}/q10"].to_pylist())[:, :, 0, 0] * 255
    for number in range(
        5
    ):  # what is not white is of its colour, but for a column beside the edge, whose chroma is shared
        assert np.abs(dark[number] - color_rgb(number)).max() < 12


def test_a_set_of_a_lower_rate_tells_every_second_state_and_the_actions_that_lead_to_them(tmp_path: Path) -> None:
    given = episodes(3)
    pictures = camera(tmp_path / "pictures", given, rate_hz=10)
    write_lerobot(given, tmp_path / "set", videos=[pictures], rate_hz=10)
    found = read_lerobot(tmp_path / "set", decode_videos=True)
    assert found.info["fps"] == 10 and found.info["features"]["observation.images.front"]["info"]["video.fps"] == 10
    for number, one in enumerate(given):
        frames, recording = found.frames(number), one.recording
        count = recording.steps // 2
        assert found.episodes[number]["length"] == count
        joints = recording.joint_positions_rad[: 2 * count + 1 : 2]
        assert np.array_equal(frames["observation.state"][:, :-1], joints[:-1])
        assert np.allclose(frames["action"][:, :-1], joints[1:], atol=1e-6), "they are reached at the next state"
        assert np.allclose(frames["action.joint_delta"][:, :-1], np.diff(joints, axis=0), atol=1e-6)
        assert np.allclose(np.diff(frames["timestamp"]), 0.1, atol=1e-6)
        assert frames["next.done"].tolist() == [False] * (count - 1) + [True]


def test_pictures_of_another_rate_than_the_sets_are_refused(tmp_path: Path) -> None:
    given = episodes(1)
    with pytest.raises(EpisodesError, match="20 frames a second, not 10; render the pictures again"):
        write_lerobot(given, tmp_path / "set", videos=[camera(tmp_path / "pictures", given)], rate_hz=10)


def test_pictures_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    given = episodes(2)
    good = camera(tmp_path / "pictures", given)
    first, second = (one.attempt.episode_id for one in given)
    short = {**good.clips, second: Clip(good.clips[second].file, good.clips[second].first_frame + 5)}
    for clips, said in (
        ({first: good.clips[first]}, "no pictures of camera 'front'"),
        (short, "render the pictures again"),
        (
            {**good.clips, second: Clip(tmp_path / "missing.mp4")},
            r"missing\.mp4: cannot be opened .*; render the pictures again",
        ),
    ):
        with pytest.raises(EpisodesError, match=said):
            write_lerobot(given, tmp_path / "set", videos=[CameraVideos("front", clips)])
        assert not (tmp_path / "set").exists()


def test_a_set_needs_episodes_of_one_robot_with_instructions(tmp_path: Path) -> None:
    mute = episode(1)
    mute = replace(mute, attempt=replace(mute.attempt, instructions=()))
    for given, said in (
        ([], "no episode"),
        ([episode(0), episode(1, of=robot(6, "ur5"))], "write one set per robot"),
        ([episode(0), mute], "no instruction"),
    ):
        with pytest.raises(EpisodesError, match=said):
            write_lerobot(given, tmp_path / "set")
        assert list(tmp_path.iterdir()) == []
