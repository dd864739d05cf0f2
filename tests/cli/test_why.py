"""Failures say why at once: the end of a command that was not all accepted, and what status adds."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from manitwin.cli.main import app
from manitwin.scenes.scene_files import read_scene
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.store import RECORD
from scene_twins import THINGS, write_things


def manitwin(*arguments: object) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)])


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Layouts of one object each, of two twins: ``data`` and ``scenes``."""
    place = tmp_path_factory.mktemp("layouts")
    write_things(place / "data", THINGS[1:3])
    made = manitwin(
        "layout", place / "data", "-o", place / "scenes", "-n", 6, "--objects", "1..1", "--executor", "inline"
    )
    assert made.exit_code == 0, made.output
    assert "why" not in made.stderr
    return place


def copied(scenes: Path, place: Path) -> tuple[Path, set[str]]:
    """A copy of scenes and their data; returns its scenes, and the twins that are in none but later ones than the first."""
    shutil.copytree(scenes, place, dirs_exist_ok=True)
    config = place / "scenes" / "config.json"
    config.write_text(config.read_text().replace(str(scenes), str(place)))
    folders = sorted((place / "scenes/scenes").glob("*/*"))
    first = {each.twin_id for each in read_scene(folders[0]).objects}
    later = {each.twin_id for folder in folders for each in read_scene(folder).objects} - first
    assert later, "the layouts must be of both twins"
    return place / "scenes", later


def test_trajectories_tell_the_most_frequent_cause_and_its_remedy(scenes: Path, tmp_path: Path) -> None:
    (place, later), out = copied(scenes, tmp_path), tmp_path / "episodes"
    for twin_id in later:
        (tmp_path / "data" / twin_name(twin_id) / RECORD).write_text("{}")
    done = manitwin("trajectories", place, "-o", out, "-n", 6, "--executor", "inline")
    assert done.exit_code == 4
    lines = done.stderr.splitlines()
    assert lines[0].startswith("why failed: ") and "twin.json: schema version None" in lines[0]
    assert "remedy: build the twin again" in lines[1]
    assert f"manitwin retry {out} and the same command again" in lines[1]
    assert "rerun the same command" not in done.output, "by itself it would try nothing again"
    told = manitwin("status", out)
    assert "schema version None" in told.stdout and "--why" in told.stdout

    for step in (
        ("retry", out),
        ("trajectories", place, "-o", out, "-n", 6, "--twins", scenes / "data", "--no-retire"),
    ):
        done = manitwin(*step, *(["--executor", "inline"] if "trajectories" in step else []))
        assert done.exit_code == 0, done.output
    assert "why" not in done.stderr


def test_scenes_whose_twins_are_gone_are_refused_before_any_work(scenes: Path, tmp_path: Path) -> None:
    (place, later), out = copied(scenes, tmp_path), tmp_path / "episodes"
    for twin_id in later:
        shutil.rmtree(tmp_path / "data" / twin_name(twin_id))
    done = manitwin("trajectories", place, "-o", out, "-n", 6)
    assert done.exit_code != 0 and "give the data set where the twins are now (--twins)" in str(done.exception)
    assert "(1 of 2 are missing)" in str(done.exception)
    assert not out.exists()


@pytest.mark.parametrize("command", ["trajectories", "render"])
def test_twins_at_a_url_are_refused_by_their_url(command: str, scenes: Path, tmp_path: Path) -> None:
    episodes = tmp_path / "episodes"
    episodes.mkdir()
    kept = {"max_placed_m": 0.05, "max_tilt_deg": 15.0}
    of_episodes = {
        "robot": "panda",
        "dataset": "gone",
        "scenes": None,
        "skill": "pick_place",
        "seed": 0,
        "episode": kept,
    }
    (episodes / "config.json").write_text(json.dumps(of_episodes | {"retire_failed_share": 0.5}))
    url = "memory://bucket/set"
    of = [scenes / "scenes", "-o", tmp_path / "out"] if command == "trajectories" else [episodes]
    done = manitwin(command, *of, "--twins", url)
    assert done.exit_code != 0 and str(done.exception).startswith(f"{url}: a data set at a URL needs a local folder")
    assert not (tmp_path / "out").exists()


def test_twins_elsewhere_are_for_scenes_alone(scenes: Path, tmp_path: Path) -> None:
    done = manitwin("trajectories", scenes / "data", "-o", tmp_path / "out", "--twins", scenes / "data")
    assert "leave --twins out" in str(done.exception)


def test_layouts_tell_why_they_were_rejected(scenes: Path, tmp_path: Path) -> None:
    crowded = ("--objects", "60..60", "--clutter", "sparse", "--executor", "inline")
    done = manitwin("layout", scenes / "data", "-o", tmp_path / "scenes", "-n", 2, *crowded)
    assert done.exit_code == 3
    assert "why rejected: 2 of 2 no_room, such as item 1: no place was found" in done.stderr
    assert "remedy: use fewer --objects" in done.stderr


def test_a_build_tells_the_most_frequent_reason_and_that_there_are_others(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "c.obj").write_text("no mesh")
    done = manitwin(
        "build", *(tmp_path / name for name in ("a.png", "b.png", "c.obj")), "-o", tmp_path / "out", "-j", 1
    )
    assert done.exit_code == 3, done.output
    assert "why rejected: 1 of 2 empty, item 1: a.png" in done.stderr and "1 duplicate" in done.stdout
    assert (
        "remedy: export or download the file again" in done.stderr and "1 other cause: manitwin status" in done.stderr
    )


def test_quiet_build_of_one_rejected_input_says_cause_and_remedy(tmp_path: Path) -> None:
    notes = tmp_path / "notes.txt"
    notes.write_text("no mesh")
    done = CliRunner().invoke(app, ["build", "-q", str(notes), "-o", str(tmp_path / "out")])
    lines = done.stderr.splitlines()
    assert done.exit_code == 3 and "wrong_type" in lines[0] and "remedy: give a photo or a mesh" in done.stderr
