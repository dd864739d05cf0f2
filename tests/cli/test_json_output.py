"""``--json``: one document on stdout that docs/json.md describes, and the same exit status."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import manitwin
from json_documents import check_keys
from manitwin.cli.main import app
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.store import read_record
from scene_twins import THINGS, write_things
from small_hand import TOML, write_hand

NONE = dict.fromkeys(("open", "accepted", "rejected", "failed", "duplicate"), 0)


def told(*arguments: object, exit_status: int = 0) -> dict[str, Any]:
    """Run a command with --json; stdout must be one document and nothing else."""
    done = CliRunner().invoke(app, [*map(str, arguments), "--json"])
    assert done.exit_code == exit_status, done.output
    document = json.loads(done.stdout)
    assert isinstance(document, dict)
    return document


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("json") / "data"
    write_things(place, THINGS[1:3])
    return place


@pytest.fixture(scope="module")
def bad(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of an empty photo, what is no mesh, and a file that is left alone."""
    folder = tmp_path_factory.mktemp("bad")
    (folder / "a.png").write_bytes(b"")
    (folder / "c.obj").write_text("no mesh")
    (folder / "notes.txt").write_text("hello")
    return folder


@pytest.mark.parametrize("name", ["panda", "suction", "hand"])
def test_gripper_tells_what_its_lines_say(name: str, tmp_path: Path) -> None:
    given = write_hand(tmp_path) if name == "hand" else name
    document = told("gripper", given)
    check_keys(document, "gripper")
    loaded = manitwin.load_gripper(given)
    assert (document["name"], document["kind"], document["sha256"]) == (loaded.name, loaded.kind, loaded.sha256)
    assert document["opening_m"] == (None if name == "suction" else loaded.opening_m) and document["picture"] is None
    assert (document["tip_depth_m"], document["force_n"]) == (loaded.tip_depth_m, loaded.force_n)
    assert document["remarks"] == []
    if name != "hand":
        assert document["joints"] == document["postures"] == []
        return
    assert document["joints"][:2] == ["thumb_1", "thumb_2"]
    widest = document["postures"][0]["openings"][-1]
    assert widest["gap_m"] == pytest.approx(widest["opening_m"], abs=0.002)
    assert widest["centers_m"][0][0] < 0 < widest["centers_m"][1][0], "the thumb is on -X"


def test_gripper_tells_where_it_was_drawn(tmp_path: Path) -> None:
    picture = tmp_path / "panda.png"
    assert told("gripper", "panda", "--draw", picture)["picture"] == str(picture) and picture.is_file()


def test_gripper_whose_file_is_wrong_is_told_as_an_error(tmp_path: Path) -> None:
    wrong = write_hand(tmp_path, TOML.replace("force_n = 8.0", "force_n = -8.0"))
    done = subprocess.run(
        [sys.executable, "-m", "manitwin", "gripper", wrong, "--json"], capture_output=True, text=True, check=False
    )
    error = json.loads(done.stdout)["error"]
    assert done.returncode == 2 and error["type"] == "UsageError" and "force_n" in error["message"]


def test_build_tells_every_input_and_why(bad: Path, tmp_path: Path) -> None:
    document = told("build", bad / "a.png", bad, "-o", tmp_path / "out", "-j", 1, exit_status=3)
    check_keys(document, "build")
    assert document["counts"] == {**NONE, "rejected": 2, "unfinished": 0} and document["exit_status"] == 3
    assert {Path(item["file"]).name: item["reason"] for item in document["items"]} == {
        "a.png": "empty",
        "c.obj": "wrong_type",
    }
    assert all(Path(item["folder"], "twin.json").is_file() and item["reused"] is False for item in document["items"])
    assert sum(cause["count"] for cause in document["causes"]) == 2 and document["remarks"]
    assert [Path(file).name for file in document["folders"][0]["left"]] == ["notes.txt"]


def test_build_and_status_tell_a_data_set(bad: Path, tmp_path: Path) -> None:
    out = tmp_path / "data"
    ran = told("build", bad, "-o", out, "--executor", "inline", exit_status=3)
    check_keys(ran, "build")
    assert ran["out"] == str(out) and ran["stopped"] is None
    status = told("status", out)
    check_keys(status, "status")
    assert status["items"] == {**NONE, "rejected": 2} and status["causes"] == ran["causes"]
    assert [stage["stage"] for stage in status["stages"]] == ["input", "assemble"]
    assert status["stages"][0]["rejected"] == 2 and isinstance(status["cpu_seconds"], float)
    story = told("status", out, "--why", "c.obj")
    check_keys(story, "status --why ITEM")
    assert story["item"]["reason"] == "wrong_type" and story["item"]["item"]["file"] == str(bad / "c.obj")


def test_show_tells_the_record_and_how_it_rests(data: Path) -> None:
    folder = next((data / "twins").glob("*/*"))
    document = told("show", folder)
    check_keys(document, "show")
    assert document["record"] == read_record(folder).model_dump(mode="json")
    first, second = document["placements"]
    assert (first["rest"], first["settled"], first["probability"], first["number"]) == ("upright", True, 0.75, 0)
    assert (second["rest"], second["settled"], second["tilt_deg"], second["side_down"]) == (
        "upside_down",
        False,
        180,
        None,
    )
    assert folder == data / twin_name(document["record"]["twin_id"])


def test_layout_and_trajectories_tell_numbers(data: Path, tmp_path: Path) -> None:
    scenes = told("layout", data, "-o", tmp_path / "scenes", "-n", 2, "--objects", "1..1", "--executor", "inline")
    check_keys(scenes, "layout")
    assert (scenes["accepted"], scenes["acceptance"], scenes["objects"]) == (2, 1.0, 2)
    assert 0 <= scenes["max_moved_m"] < 0.01 and scenes["exit_status"] == 0
    episodes = told(
        "trajectories", tmp_path / "scenes", "-o", tmp_path / "episodes", "-n", 2, "--no-retire", "--executor", "inline"
    )
    check_keys(episodes, "trajectories")
    assert episodes["attempts"]["attempted"] == 2 and episodes["counts"]["accepted"] == 2
    assert sum(episodes["attempts"]["outcomes"].values()) == 2 and episodes["retired_now"] == 0


@pytest.mark.parametrize(
    ("arguments", "kind", "message"),
    [
        (("build", "nothing_here.png", "-o", "out"), "UsageError", "nothing_here.png: not found"),
        (("build", "--nonsense"), "NoSuchOption", "--nonsense"),
        (("build", "--text", "a mug", "-v", "--nonsense"), "NoSuchOption", "--nonsense"),
        (("show", "nowhere"), None, "nowhere"),
        (("status", "nowhere"), None, "nowhere"),
        (("status", "nowhere", "--watch"), None, ""),
    ],
)
def test_an_error_is_a_document_too(tmp_path: Path, arguments: tuple[str, ...], kind: str | None, message: str) -> None:
    command = [sys.executable, "-m", "manitwin", *arguments, "--json"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=dict(os.environ))
    error = json.loads(done.stdout)["error"]
    assert set(error) == {"type", "message", "exit_status"} and error["exit_status"] == done.returncode == 2
    assert message in error["message"] and message in done.stderr and (kind is None or error["type"] == kind)


@pytest.mark.parametrize(
    "arguments",
    [
        ("build", "x.png", "-o", "out", "--text", "--json"),
        ("build", "-o", "out", "--text", "--json", "--nonsense"),
        ("status", "--", "--json"),
        ("status", "--why", "--json", "--nonsense"),
        ("build", "-o", "--json", "--", "x.png", "--json"),
    ],
)
def test_an_error_is_no_document_where_the_words_are_a_value(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    command = [sys.executable, "-m", "manitwin", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=dict(os.environ))
    assert done.returncode == 2 and done.stdout == "" and done.stderr.startswith("manitwin ")


def test_without_it_the_next_command_prints_as_ever(data: Path) -> None:
    folder = next((data / "twins").glob("*/*"))
    told("show", folder)
    assert "rests" in CliRunner().invoke(app, ["show", str(folder)]).stdout
