"""What a command line does not ask for is left out, and nobody sees it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from imported_modules import imported_of
from manitwin.cli.lazy_help import only_asked_for
from manitwin.cli.main import app

NAMES = sorted(typer.main.get_command(app).commands)  # type: ignore[attr-defined]
PUT_OFF = """
import sys
from manitwin.cli.lazy_help import import_quick_help
import_quick_help()
import typer.rich_utils as drawn
assert not {"rich.markdown", "rich.traceback", "pygments"} & set(sys.modules)
markdown = drawn.Markdown("**bold**")
try:
    raise ValueError("said")
except ValueError as error:
    trace = drawn.Traceback.from_exception(type(error), error, error.__traceback__)
from rich.markdown import Markdown
from rich.traceback import Traceback
assert type(markdown) is Markdown and type(trace) is Traceback
"""
HELP = """
import sys
from manitwin.cli.main import main
sys.argv = ["manitwin", "--help"]
try:
    main()
finally:
    print(sorted({"rich.markdown", "rich.traceback", "pygments", "numpy"} & set(sys.modules)))
"""
PLAN = """
import sys
from manitwin.cli.main import main
sys.argv = ["manitwin", "build", "--text", "a mug", "-o", sys.argv[1], "--dry-run"]
try:
    main()
finally:
    print(sorted({"trimesh", "cascadio._core", "collada.common"} & set(sys.modules)))
"""


def said(application: typer.Typer, words: list[str]) -> tuple[int, str]:
    """Return the exit status of a command line, and what it prints."""
    done = CliRunner().invoke(application, words, env={"COLUMNS": "100"}, prog_name="manitwin")
    return done.exit_code, done.output


@pytest.mark.parametrize(
    "words", [[], ["--help"], ["paint"], ["--wrong"], *([*name.split(), "--help"] for name in NAMES)]
)
def test_what_is_said_is_as_with_all_commands(words: list[str]) -> None:
    assert said(only_asked_for(app, words), words) == said(app, words)


def test_other_commands_have_no_parameters_and_the_asked_ones_all() -> None:
    asked = typer.main.get_command(only_asked_for(app, ["review", "report"])).commands  # type: ignore[attr-defined]
    whole = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    with_parameters = {name for name, command in asked.items() if command.params}
    assert with_parameters == {name for name in NAMES if name.split()[0] == "review"}
    for name in with_parameters:
        assert [each.name for each in asked[name].params] == [each.name for each in whole[name].params]
    assert {name: command.hidden for name, command in asked.items()} == {name: whole[name].hidden for name in NAMES}


def test_help_imports_neither_markdown_nor_tracebacks() -> None:
    done = subprocess.run([sys.executable, "-c", HELP], capture_output=True, text=True)
    assert "Commands" in done.stdout and done.stdout.rstrip().endswith("[]"), done.stderr


def test_what_was_put_off_is_imported_when_it_is_called() -> None:
    done = subprocess.run([sys.executable, "-c", PUT_OFF], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_a_build_loads_no_reader_of_a_format_that_it_was_not_given(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", PLAN, str(tmp_path / "twins")], capture_output=True, text=True)
    assert done.stdout.rstrip().endswith("['trimesh']"), done.stdout + done.stderr


@pytest.mark.parametrize("words", [["-h"], ["build", "-h"], ["review", "sample", "-h"]])
def test_h_asks_for_help_too(words: list[str]) -> None:
    asked = [CliRunner().invoke(app, [*words[:-1], option]) for option in ("-h", "--help")]
    assert [done.exit_code for done in asked] == [0, 0] and asked[0].output == asked[1].output
    assert "Usage:" in asked[0].output


def test_what_knows_names_alone_loads_no_library_of_meshes() -> None:
    """A catalogue's status, and why items of a run were rejected."""
    modules = "manitwin.dataset.collect.status", "manitwin.pipeline.guesses", "manitwin.pipeline.size_remarks"
    assert imported_of({"trimesh", "networkx"}, *modules) == set()
