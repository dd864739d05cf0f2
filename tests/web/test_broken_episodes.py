"""Episodes that are broken or lack something: said in one line, and what else there is stays."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from asked_episodes import document, get, run_of, stored_ones

from drawn_episodes import stored, write_run
from drawn_scenes import write_scenes
from manitwin.twin.dataset_root import twin_name
from manitwin.web.episode_document import DOCUMENT


def spoil(place: Path, array: str, change: Any) -> None:
    """Change an array of the first episode in the file, so that it could never have been written so."""
    with h5py.File(place / "maniskill" / "trajectory.h5", "r+") as file:
        content = file["traj_0"][array][()]
        del file["traj_0"][array]
        change(file["traj_0"], content)


def not_finite(group: h5py.Group, content: np.ndarray) -> None:
    content[3, 0] = np.nan
    group["obs/extra/tcp_pose"] = content


def no_rotation(group: h5py.Group, content: np.ndarray) -> None:
    content[3, 3:] = 0
    group["obs/extra/tcp_pose"] = content


def in_another_file(group: h5py.Group, content: np.ndarray) -> None:
    group["obs/extra/tcp_pose"] = h5py.ExternalLink("/etc/passwd", "/x")


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (not_finite, "is not finite"),
        (no_rotation, "not of length 1"),
        (in_another_file, "is a link"),
    ],
)
def test_a_broken_episode_says_so_in_one_line_and_leaves_the_others(tmp_path: Path, change: Any, cause: str) -> None:
    place = write_run(tmp_path)
    spoil(place, "obs/extra/tcp_pose", change)
    status, body = get(place, f"/episode/0/{DOCUMENT}")
    alert = body.decode().partition('role="alert">')[2].partition("</p>")[0]
    assert status == 422 and cause in alert and "\n" not in alert
    assert get(place, "/")[0] == get(place, "/episode/0")[0] == get(place, f"/episode/1/{DOCUMENT}")[0] == 200


def test_an_episode_of_more_bytes_than_the_limit_is_not_read(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with h5py.File(run / "maniskill" / "trajectory.h5") as file:
        sizes: list[int] = []
        file["traj_0"].visititems(
            lambda _, found: sizes.append(found.nbytes) if isinstance(found, h5py.Dataset) else None
        )
    monkeypatch.setattr("manitwin.web.episode_folders.MOST_EPISODE_BYTES", sum(sizes))
    assert get(run, f"/episode/0/{DOCUMENT}")[0] == 200
    monkeypatch.setattr("manitwin.web.episode_folders.MOST_EPISODE_BYTES", sum(sizes) - 1)
    status, body = get(run, f"/episode/0/{DOCUMENT}")
    assert status == 422 and f"{sum(sizes):,} bytes of arrays".encode() in body


def test_an_episode_that_says_nothing_of_itself_is_a_line_of_the_list(tmp_path: Path) -> None:
    place = write_run(tmp_path)
    with h5py.File(place / "maniskill" / "trajectory.h5", "r+") as file:
        file["traj_0"].attrs["episode"] = np.bytes_(b'{"attempt": 3}')
    (place / "attempts.parquet").unlink()
    page = get(place, "/")[1]
    assert page.count(b'class="error"') == 1 and b'href="/episode/1"' in page
    assert get(place, "/episode/0")[0] == 422 and get(place, "/episode/1")[0] == 200


def test_a_table_of_attempts_that_is_broken_or_another_runs_leaves_the_recorded_episodes(
    run: Path, tmp_path: Path
) -> None:
    shutil.copytree(run.parent, tmp_path / "copy")
    place = tmp_path / "copy" / "episodes"
    shutil.copy(write_run(tmp_path / "other", stored_ones(tmp_path / "other", 1)) / "attempts.parquet", place)
    page = get(place, "/")[1]
    assert b"tells of 1 recorded episodes, and there are 2" in page and b'href="/episode/1"' in page
    (place / "attempts.parquet").write_bytes(b"PAR1")
    assert b"no Parquet file" in get(place, "/")[1]


def test_a_file_that_names_a_data_set_at_an_address_asks_nobody(tmp_path: Path) -> None:
    place = write_run(tmp_path)
    config = json.loads((place / "config.json").read_text())
    (place / "config.json").write_text(json.dumps({**config, "dataset": "https://127.0.0.1:9/set"}))
    told = document(place)
    assert "https://127.0.0.1:9/set" in told["unreadable"][0] and "--twins" in told["unreadable"][0]


def test_a_twin_that_is_gone_leaves_the_rest(tmp_path: Path) -> None:
    place = write_run(tmp_path)
    gone, other = (each["twin_id"] for each in document(place)["objects"])
    shutil.rmtree(tmp_path / "set" / twin_name(gone))
    told = document(place)
    assert len(told["unreadable"]) == 1 and gone in told["unreadable"][0]
    assert [each["model"] is None for each in told["objects"]] == [True, False] and other != gone


@pytest.mark.parametrize(
    ("of", "cause"),
    [({"name": "nobody"}, "none of the package"), ({"arm_joints": ("a",) * 7}, "other joints")],
)
def test_a_robot_that_is_not_known_leaves_the_objects(tmp_path: Path, of: dict[str, Any], cause: str) -> None:
    write_scenes(tmp_path)
    one = stored(tmp_path, 0)
    told = document(write_run(tmp_path, [replace(one, robot=replace(one.robot, **of))]))
    assert told["robots"] == [] and cause in told["unreadable"][0] and len(told["objects"][0]["poses"]) > 7


def test_facts_that_are_none_cost_their_own_part_only(tmp_path: Path) -> None:
    told = document(run_of(tmp_path, facts={"furniture": 3, "goal_object_to_world": "x"}))
    assert told["furniture"] == [] and told["goal"] is None and "facts.furniture" in told["unreadable"][0]
