"""Recorded episodes as HDF5: what comes back, how ManiSkill would read it, and the same bytes again."""

from __future__ import annotations

import json
import time
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_episodes import episode, recording, robot, with_granules

from manitwin.episodes.hdf5_file import EpisodeFile, write_episodes
from manitwin.episodes.hdf5_merge import METADATA, TRAJECTORIES, merge_episodes
from manitwin.episodes.recording import Recording, joint_delta, tip_delta
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.errors import EpisodesError


def same(one: StoredEpisode, other: StoredEpisode) -> bool:
    arrays = all(
        np.array_equal(a, b) and np.asarray(a).dtype == np.asarray(b).dtype
        for a, b in ((getattr(one.recording, f.name), getattr(other.recording, f.name)) for f in fields(Recording))
    )
    return arrays and replace(one, recording=other.recording) == other


def maniskill_loads(group: h5py.Group) -> dict[str, Any]:
    """What ManiSkill's ``load_h5_data`` does with a trajectory."""
    return {k: v[:] if isinstance(v, h5py.Dataset) else maniskill_loads(v) for k, v in group.items()}


@pytest.mark.parametrize(
    ("state", "told"),
    [(("plunger",), ("vacuum",)), (tuple(f"f{i}" for i in range(16)), tuple(f"f{i}" for i in range(16)))],
)
def test_hands_that_are_no_jaws_come_back_too(tmp_path: Path, state: tuple[str, ...], told: tuple[str, ...]) -> None:
    given, rng = episode(1), np.random.default_rng(4)
    steps = given.recording.steps
    hand, action = (
        rng.uniform(-1, 1, shape).astype(np.float32) for shape in ((steps + 1, len(state)), (steps, len(told)))
    )
    other = replace(
        given,
        recording=replace(given.recording, hand=hand, action_hand=action),
        robot=replace(given.robot, finger_joints=state, hand_state=state, hand_action=told),
    )
    write_episodes(tmp_path / "one.h5", [other])
    with EpisodeFile(tmp_path / "one.h5") as file:
        assert same(file[0], other)
    with h5py.File(tmp_path / "one.h5") as file:
        arm = len(given.robot.arm_joints)
        assert np.array_equal(file["traj_0/obs/agent/qpos"][:, arm:], hand)
        assert np.array_equal(file["traj_0/actions"][:, arm:], action)
    wrong = replace(other, recording=replace(other.recording, action_hand=action[:, :0]))
    with pytest.raises(EpisodesError, match=r"action_hand has the shape"):
        write_episodes(tmp_path / "wrong.h5", [wrong])


def test_episodes_come_back_as_they_were(tmp_path: Path) -> None:
    given = [
        episode(0),
        episode(1, steps=1),
        episode(2, of=robot(6, "ur5"), things=1),
        with_granules(episode(3, steps=200, things=12)),
    ]
    assert write_episodes(tmp_path / "a.h5", given) == 4
    with EpisodeFile(tmp_path / "a.h5") as file:
        assert len(file) == 4
        assert all(same(one, other) for one, other in zip(given, file, strict=True))
        with pytest.raises(IndexError):
            file[4]


def test_granules_are_absent_where_there_are_none_and_refused_where_they_do_not_fit(tmp_path: Path) -> None:
    given = with_granules(episode(1))
    write_episodes(tmp_path / "a.h5", [episode(0), given])
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        assert "granules_in_objects" not in file["traj_0/manitwin"]
        assert file["traj_1/manitwin/granules_in_objects"].dtype == np.int16
        del file["traj_1/manitwin/granule_positions_m"]
        file["traj_1/manitwin/granule_positions_m"] = np.zeros((3, 9, 3), np.float32)
    with EpisodeFile(tmp_path / "a.h5") as file, pytest.raises(EpisodesError, match="granules have the shapes"):
        file[1]
    assert given.recording.granules_in_objects is not None
    short = replace(given.recording, granules_in_objects=given.recording.granules_in_objects[:-1])
    with pytest.raises(EpisodesError, match="granules_in_objects has the shape"):
        write_episodes(tmp_path / "b.h5", [replace(given, recording=short)])


def test_same_episodes_give_the_same_bytes_at_any_time(tmp_path: Path) -> None:
    write_episodes(tmp_path / "a.h5", (episode(i) for i in range(3)))
    time.sleep(1.1)  # HDF5 keeps times in seconds
    write_episodes(tmp_path / "b.h5", (episode(i) for i in range(3)))
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()
    files = [tmp_path / "a.h5", tmp_path / "b.h5"]
    merge_episodes(files, tmp_path / "one")
    time.sleep(1.1)
    merge_episodes(files, tmp_path / "two")
    for name in (TRAJECTORIES, METADATA):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_a_state_sets_a_maniskill_scene(tmp_path: Path) -> None:
    given = episode(5)
    write_episodes(tmp_path / "a.h5", [given])
    taken = given.recording
    with h5py.File(tmp_path / "a.h5") as file:
        loaded = maniskill_loads(file["traj_0"])
    steps, arm = taken.steps, 7
    assert loaded["actions"].shape == (steps, arm + 1) and loaded["actions"].dtype == np.float32
    assert loaded["terminated"].tolist() == loaded["success"].tolist() == [False] * (steps - 1) + [True]
    assert not loaded["truncated"].any() and loaded["truncated"].dtype == bool
    assert set(loaded["env_states"]["actors"]) == {"object_00", "object_01", "object_02"}
    actor = loaded["env_states"]["actors"]["object_01"]
    assert np.array_equal(actor[:, :3], taken.object_positions_m[:, 1])
    assert np.array_equal(actor[:, 3:7], taken.object_quaternions_wxyz[:, 1])
    assert np.array_equal(actor[:, 7:10], taken.object_linear_velocities_m_s[:, 1])
    state = loaded["env_states"]["articulations"]["panda"]
    assert state.shape == (steps + 1, 13 + 2 * 9)
    qpos, qvel = np.split(state[:, 13:], 2, axis=1)  # as ManiSkill's Articulation.set_state takes it apart
    assert np.array_equal(qpos[:, :arm], taken.joint_positions_rad)
    assert np.array_equal(qvel[:, :arm], taken.joint_velocities_rad_s)
    assert np.allclose(qpos[:, arm] + qpos[:, arm + 1], taken.gripper_opening_m, atol=1e-7)
    # finger speeds lead from one opening to the next
    assert np.allclose(qpos[:-1, arm] + qvel[:-1, arm] / 20, qpos[1:, arm], atol=1e-6)
    assert np.array_equal(state[:, :13], np.tile(np.eye(13, dtype=np.float32)[3], (steps + 1, 1)))
    assert np.array_equal(
        loaded["obs"]["extra"]["obj_pose"], loaded["env_states"]["actors"][f"object_{taken.target:02d}"][:, :7]
    )


def test_deltas_lead_from_the_state_to_the_target() -> None:
    taken = recording(3, 30)
    joints, tip = joint_delta(taken), tip_delta(taken)
    assert np.allclose(taken.joint_positions_rad[:-1] + joints[:, :-1], taken.action_joint_positions_rad, atol=1e-6)
    assert np.array_equal(joints[:, -1], taken.action_gripper_opening_m)
    assert np.array_equal(tip[:, -1], taken.action_gripper_opening_m)
    assert np.allclose(taken.tip_position_m[:-1] + tip[:, :3], taken.action_tip_position_m, atol=1e-6)
    # the synthetic tip turns about the world's vertical by 0.3 rad a second
    assert np.allclose(tip[:, 3:6], [0, 0, 0.3 / 20], atol=1e-6)
    turned = Rotation.from_rotvec(tip[:, 3:6]) * Rotation.from_quat(taken.tip_quaternion_wxyz[:-1], scalar_first=True)
    off = turned.inv() * Rotation.from_quat(taken.action_tip_quaternion_wxyz, scalar_first=True)
    assert off.magnitude().max() < 1e-6


def test_merging_numbers_without_gaps_and_tells_maniskill_of_each(tmp_path: Path) -> None:
    given = [episode(i, of=robot(6, "ur5") if i == 4 else None) for i in range(6)]
    files = [tmp_path / f"{i}.h5" for i in range(4)]
    for path, some in zip(files, (given[:2], [], given[2:5], given[5:]), strict=True):
        write_episodes(path, some)
    assert merge_episodes(files, tmp_path / "maniskill") == 6
    with EpisodeFile(tmp_path / "maniskill" / TRAJECTORIES) as file:
        assert all(same(one, other) for one, other in zip(given, file, strict=True))
    told = json.loads((tmp_path / "maniskill" / METADATA).read_text())
    assert [row["episode_id"] for row in told["episodes"]] == list(range(6))
    assert [row["elapsed_steps"] for row in told["episodes"]] == [e.recording.steps for e in given]
    assert [row["episode_seed"] for row in told["episodes"]] == [e.attempt.seed for e in given]
    assert all(row["success"] and row["control_mode"] == "pd_joint_pos" for row in told["episodes"])
    assert [row["attempt"]["episode_id"] for row in told["episodes"]] == [e.attempt.episode_id for e in given]
    assert told["env_info"]["max_episode_steps"] == max(e.recording.steps for e in given)
    assert set(told["env_info"]["env_kwargs"]["robots"]) == {"panda", "ur5"}
    assert told["source_type"] == "motionplanning"


def test_merging_nothing_gives_an_empty_file(tmp_path: Path) -> None:
    assert merge_episodes([], tmp_path) == 0
    assert json.loads((tmp_path / METADATA).read_text())["episodes"] == []
    with EpisodeFile(tmp_path / TRAJECTORIES) as file:
        assert len(file) == 0


def test_two_robots_of_one_name_are_refused_and_the_old_file_stays(tmp_path: Path) -> None:
    write_episodes(tmp_path / "a.h5", [episode(0)])
    write_episodes(tmp_path / "b.h5", [episode(1, of=replace(robot(), sha256="1" * 64))])
    merge_episodes([tmp_path / "a.h5"], tmp_path / "m")
    before = (tmp_path / "m" / TRAJECTORIES).read_bytes()
    with pytest.raises(EpisodesError, match="'panda' differs from the robot of this name"):
        merge_episodes([tmp_path / "a.h5", tmp_path / "b.h5"], tmp_path / "m")
    assert (tmp_path / "m" / TRAJECTORIES).read_bytes() == before
    assert sorted(p.name for p in (tmp_path / "m").iterdir()) == [TRAJECTORIES, METADATA]


def test_a_writer_that_fails_leaves_nothing_behind(tmp_path: Path) -> None:
    def failing() -> Any:
        yield episode(0)
        raise RuntimeError("the simulation died")

    with pytest.raises(RuntimeError):
        write_episodes(tmp_path / "a.h5", failing())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"joint_positions_rad": np.zeros((21, 6), np.float32)}, "joint_positions_rad has the shape"),
        ({"phase": np.zeros(0, np.uint8)}, "0 steps"),
        ({"target": 3}, "target 3 of 3 objects"),
        ({"finger_forces_n": np.full((21, 2), np.nan, np.float32)}, "finger_forces_n is not finite"),
        ({"action_hand": np.zeros((21, 1), np.float32)}, "action_hand has the shape"),
    ],
)
def test_recordings_that_do_not_fit_together_are_refused(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    good = episode(0, steps=20)
    with pytest.raises(EpisodesError, match=said):
        write_episodes(tmp_path / "a.h5", [replace(good, recording=replace(good.recording, **change))])
    assert not (tmp_path / "a.h5").exists()


def test_files_of_others_are_told_apart(tmp_path: Path) -> None:
    (tmp_path / "text.h5").write_text("no HDF5")
    with pytest.raises(EpisodesError, match="not a readable HDF5 file"):
        EpisodeFile(tmp_path / "text.h5")
    with pytest.raises(EpisodesError, match=r"no HDF5 file|cannot be opened"):
        EpisodeFile(tmp_path / "missing.h5")
    write_episodes(tmp_path / "a.h5", [episode(0), episode(1)])
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file.move("traj_1", "traj_2")
    with pytest.raises(EpisodesError, match="no traj_1"):
        EpisodeFile(tmp_path / "a.h5")
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file.create_dataset("traj_0/actions", data=np.zeros((3, 8)))
    with (
        EpisodeFile(tmp_path / "b.h5") as foreign,
        pytest.raises(EpisodesError, match="it was not written by this package"),
    ):
        foreign[0]
