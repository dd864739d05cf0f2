"""What every command that writes says of a folder that it cannot write into, and of one that is not there to go on with."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from manitwin.cli.main import app
from manitwin.errors import UsageError

COMMANDS = {
    "build": ["--text", "a mug"],
    "export": ["IN", "--to", "glb"],
    "import": ["IN"],
    "layout": ["IN"],
    "prompts": ["IN"],
    "publish": ["IN"],
    "stats": ["IN"],
    "trajectories": ["IN"],
}


@pytest.mark.parametrize("out", ["dangling", "file", "/dev/null/x", "/proc/x"])
@pytest.mark.parametrize("command", COMMANDS)
def test_folder_that_cannot_be_written_is_refused_before_any_work(tmp_path: Path, command: str, out: str) -> None:
    (tmp_path / "IN").mkdir()
    (tmp_path / "file").touch()
    (tmp_path / "dangling").symlink_to("nowhere")
    words = [str(tmp_path / "IN") if word == "IN" else word for word in COMMANDS[command]]
    done = CliRunner().invoke(app, [command, *words, "-o", str(tmp_path / out)])
    assert isinstance(done.exception, UsageError) and "; give a folder to write" in str(done.exception), done.output
    assert str(tmp_path / out) in str(done.exception)


@pytest.mark.parametrize("more", [[], ["--dry-run"]])
def test_run_without_inputs_of_a_data_set_that_is_not_there_makes_none(tmp_path: Path, more: list[str]) -> None:
    done = CliRunner().invoke(app, ["build", "-o", str(tmp_path / "ds9"), *more])
    assert isinstance(done.exception, UsageError) and "no data set to resume" in str(done.exception)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "words", [["evaluate", "grasps", "IN"], ["evaluate", "generation", "IN"], ["locate", "IN"], ["capture"]]
)
def test_new_folder_that_has_something_in_it_is_refused_before_any_work(tmp_path: Path, words: list[str]) -> None:
    (tmp_path / "IN").mkdir()
    (tmp_path / "OUT").mkdir()
    (tmp_path / "OUT" / "mine.txt").touch()
    given = [str(tmp_path / "IN") if word == "IN" else word for word in words]
    done = CliRunner().invoke(app, [*given, "--out", str(tmp_path / "OUT")])
    assert isinstance(done.exception, UsageError), done.output
    assert str(done.exception) == f"{tmp_path / 'OUT'}: is there and not empty; give a new folder"
