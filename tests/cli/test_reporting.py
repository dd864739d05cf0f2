"""How much a command says, and the log that it leaves."""

from __future__ import annotations

import inspect
import logging
import os
import re
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from manitwin.cli.main import app
from manitwin.cli.run_log import RedactingFormatter, RunLog, begin_log, end_log
from manitwin.engine.ledger.location import local_log
from manitwin.twin.dataset_root import DatasetRoot

PACKAGE = logging.getLogger("manitwin")
MAKING = ("build", "run", "layout", "trajectories", "render", "export", "import", "publish", "stats", "index")
TIME = r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d{3}Z"

# A command line whose `layout` is a rehearsal, with items that are accepted, rejected, and fail with a traceback.
PROGRAM = """
import sys
from pathlib import Path
import manitwin.cli.main as cli
from manitwin.cli.reporting import with_reporting_options
from manitwin.cli.console import err_console, out_console, print_error
from manitwin.cli.progress import RunDisplay

def work() -> None:
    from manitwin.config import RunConfig
    from manitwin.twin.dataset_root import DatasetRoot
    from manitwin.engine.drive import drive
    from rehearsal_recipe import RehearsalRecipe
    from manitwin.pipeline.item import Item

    root = DatasetRoot("data")
    items = [Item(file=None, text=text) for text in ("good", "reject:b", "raise:a")]
    with RunDisplay("layouts", "data") as watched:
        drive(
            RehearsalRecipe(), items, root, RunConfig(cpu=1, attempts=1), configuration={}, executor="inline",
            **watched.callbacks,
        )
    err_console.print("a remark with https://user:word@host/x and %s" % KEY, markup=False)
    out_console.print("a result", markup=False)
    print_error("one of them failed")

KEY = "sk-1234567890-not-a-real-key"
cli.app.registered_commands = [each for each in cli.app.registered_commands if each.callback.__name__ != "layout"]
cli.app.command("layout")(with_reporting_options(work, own_log=True))
cli.main()
"""


def rehearse(folder: Path, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", PROGRAM, *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, env={**os.environ, **environment})


def test_every_command_that_makes_something_takes_the_options() -> None:
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    for name in MAKING:
        taken = {option for parameter in commands[name].params for option in parameter.opts}
        assert {"--verbose", "-v", "--quiet", "-q", "--log"} <= taken, name


@pytest.mark.parametrize(
    "words",
    [
        ("layout", "-q"),
        pytest.param(("-q", "layout"), marks=pytest.mark.slow),
        pytest.param(("layout", "--quiet"), marks=pytest.mark.slow),
    ],
)
def test_quiet_says_errors_alone(tmp_path: Path, words: tuple[str, ...]) -> None:
    done = rehearse(tmp_path, *words)
    assert (done.stdout, done.stderr) == ("", "one of them failed\n")
    assert "a result" in (tmp_path / "data" / "run.log").read_text(), "the log has it all the same"


@pytest.mark.parametrize("words", [("layout", "-v"), pytest.param(("-v", "layout"), marks=pytest.mark.slow)])
def test_verbose_says_stages_and_their_seconds(tmp_path: Path, words: tuple[str, ...]) -> None:
    done = rehearse(tmp_path, *words)
    assert re.search(r"^a of 'good' \(\w+\) done in \d+\.\d\d s$", done.stderr, re.MULTILINE), done.stderr
    assert "b of 'reject:b'" in done.stderr and "poor_quality" in done.stderr
    assert done.stderr.count("a remark") == 1, "nothing is printed twice"
    assert "done in" not in rehearse(tmp_path, "layout").stderr


def test_quiet_and_verbose_contradict_each_other(tmp_path: Path) -> None:
    done = rehearse(tmp_path, "layout", "-q", "-v")
    assert done.returncode == 2 and "contradict" in done.stderr
    assert not (tmp_path / "data").exists()


def test_log_tells_the_whole_run_with_times_and_the_next_run_adds_to_it(tmp_path: Path) -> None:
    rehearse(tmp_path, "layout")
    text = (tmp_path / "data" / "run.log").read_text()
    first = [line for line in text.splitlines() if re.match(TIME, line)]
    assert re.fullmatch(rf"{TIME} INFO    manitwin \S+: layout", first[0])
    for said in (
        r"INFO    run 1 begins: recipe [0-9a-f]{16}, seed 0",
        r"INFO    3 layouts, 3 to do",
        r"DEBUG   a of 'good' \(\w+\) begins",
        r"INFO    item 1 'good' \w+ accepted: ",
        r"INFO    item 2 'reject:b' \w+ rejected: ",
        r"WARNING a of 'raise:a' \(\w+\) failed: RuntimeError",
        r"ERROR   one of them failed",
        r"INFO    run ends: finished; (?=.*1 accepted)(?=.*1 rejected)(?=.*1 failed)",
        r"INFO    ends with exit status 0",
    ):
        assert re.search(rf"^{TIME} {said}", text, re.MULTILINE), (said, text)
    assert "Traceback (most recent call last)" in text and "rehearsal_recipe.py" in text
    rehearse(tmp_path, "layout")
    again = (tmp_path / "data" / "run.log").read_text()
    assert again.startswith(text) and "run 2 begins" in again


def test_log_lies_where_it_is_asked_for(tmp_path: Path) -> None:
    rehearse(tmp_path, "layout", "--log", "here/mine.log")
    assert "run 1 begins" in (tmp_path / "here" / "mine.log").read_text()
    assert not (tmp_path / "data" / "run.log").exists()


@pytest.mark.parametrize(("place_follows", "path"), [(False, None), (True, None), (False, "x.log")])
def test_records_are_kept_only_for_a_log_that_has_a_place(
    tmp_path: Path, place_follows: bool, path: str | None
) -> None:
    kept = place_follows or path is not None
    begin_log(path and tmp_path / path, place_follows)
    try:
        assert any(isinstance(handler, RunLog) for handler in PACKAGE.handlers) is kept
    finally:
        end_log()


def _closure(function: Callable[..., None]) -> dict[str, Any]:
    return dict(inspect.getclosurevars(function).nonlocals)


def test_commands_without_a_place_for_a_log_keep_no_records() -> None:
    callbacks = {each.name or each.callback.__name__: each.callback for each in app.registered_commands}  # type: ignore[union-attr]
    own = {name for name in MAKING if _closure(_closure(callbacks[name])["command"])["own_log"]}
    assert own == {"build", "run", "layout", "trajectories", "render"}


def test_a_tree_without_metadata_tells_that_it_has_no_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr("importlib.metadata.version", missing)
    assert CliRunner().invoke(app, ["--version"]).output == "manitwin 0+unknown\n"
    log = tmp_path / "a.log"
    try:
        CliRunner().invoke(app, ["index", str(tmp_path), "--log", str(log)])
    finally:
        end_log()
    assert "manitwin 0+unknown: " in log.read_text()


def test_log_that_cannot_be_written_is_a_usage_error(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = rehearse(tmp_path, "layout", "--log", "file/mine.log")
    assert done.returncode == 2 and done.stderr.startswith("manitwin layout: file/mine.log: cannot be written")


def test_keys_and_passwords_never_reach_the_log(tmp_path: Path) -> None:
    done = rehearse(tmp_path, "layout", "-v", MANITWIN_VLM_KEY="sk-1234567890-not-a-real-key")
    text = (tmp_path / "data" / "run.log").read_text()
    assert done.returncode == 0 and "sk-1234567890" not in text and "user:word" not in text
    assert "a remark with https://***@host/x and ***" in text


def test_a_key_in_a_traceback_is_hidden_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOME_TOKEN", "hush-hush-hush")
    try:
        raise ValueError("refused: Bearer hush-hush-hush")
    except ValueError:
        record = logging.LogRecord("manitwin", logging.ERROR, "", 0, "it failed", None, sys.exc_info())
    assert "Bearer ***" in RedactingFormatter().format(record)
    assert "hush" not in RedactingFormatter().format(record)


def test_log_of_a_url_lies_beside_its_ledger(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert local_log(DatasetRoot(tmp_path / "data")) == tmp_path / "data" / "run.log"
    assert re.fullmatch(r"[0-9a-f]{16}\.log", local_log(DatasetRoot("memory://set")).name)
    assert local_log(DatasetRoot("memory://set")).is_relative_to(tmp_path)


def test_log_is_no_part_of_a_data_set(tmp_path: Path) -> None:
    rehearse(tmp_path, "layout")
    done = subprocess.run(
        [sys.executable, "-m", "manitwin", "check", "data"], cwd=tmp_path, capture_output=True, text=True
    )
    assert "the ledger and the folders agree" in done.stdout and (tmp_path / "data" / "run.log").exists()


def test_addresses_are_printed_as_they_are(capfd: pytest.CaptureFixture[str]) -> None:
    from manitwin.cli.console import err_console

    err_console.print("failed http://h:x: no", markup=False)
    assert capfd.readouterr().err == "failed http://h:x: no\n"
