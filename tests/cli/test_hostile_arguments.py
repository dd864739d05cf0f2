"""Every option and argument of every command with values that nobody means: one line, exit 2, nothing written."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

import manitwin.cli.main as main_module
from manitwin.cli import options
from manitwin.cli.arguments import LONGEST_PLACE, PLACES, CheckedCommand
from manitwin.cli.main import app
from manitwin.config import LARGEST_SEED, MOST_SLOTS
from manitwin.errors import UsageError
from manitwin.scenes.settings import MOST_OBJECTS

COMMANDS: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]
WRONG_NUMBERS = (
    "-1",
    str(-(2**80)),
    str(2**80),
    str(10**30),
    "nan",
    "inf",
    "-inf",
    "1e400",
    "9" * 10_000,
    "x",
    "\x1b[31m",
    "1.5.2",
)
OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\ud800-\udfff]")
RENAMED = {"run"}
"""Does as ``build``, after a line that says so."""
SERVES = {"fake"}
"""What would go on until it is interrupted, were its other arguments right."""


def parameters(is_wanted: Any) -> list[Any]:
    wanted = []
    for command, found in COMMANDS.items():
        for parameter in found.params:
            if is_wanted(parameter) and command not in RENAMED:
                wanted.append(pytest.param(command, parameter, id=f"{command} {parameter.opts[0]}"))
    return wanted


def is_number(parameter: Any) -> bool:
    return parameter.type_descriptor.annotation in (int, float)


def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str]:
    monkeypatch.setattr(sys, "argv", ["manitwin", *arguments])
    status = main_module._run()
    said = capsys.readouterr()
    return status, said.err + said.out


def required(command: str, but: str, folder: Path) -> list[str]:
    """Arguments that a command cannot be without, of which none is there: whatever is not refused before is refused then."""
    given: list[str] = []
    for parameter in COMMANDS[command].params:
        if parameter.required and parameter.name != but:
            value = str(folder / "out") if parameter.name == "out" else "nothing-there"
            given += [value] if parameter.param_type_name == "argument" else [parameter.opts[0], value]
    return given


def placed(command: str, parameter: Any, value: str, folder: Path) -> list[str]:
    """Return a command line with a value for one parameter, also where it begins with a hyphen."""
    others = required(command, parameter.name, folder)
    if parameter.param_type_name == "argument":
        return [command, *[each for each in others if each != "nothing-there"], "--", value]
    return [
        command,
        f"{parameter.opts[0]}={value}" if parameter.opts[0].startswith("--") else parameter.opts[0] + value,
        *others,
    ]


def check_one_line(said: str, command: str) -> None:
    lines = [line for line in said.splitlines() if line.strip()]
    assert len(lines) == 1 and lines[0].startswith("manitwin"), (command, said[:500])
    assert len(lines[0]) < 2000 and not OBEYED.search(said), said[:500]
    assert "Traceback" not in said


@pytest.fixture
def empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A working folder in which nothing may be left behind."""
    folder = tmp_path / "cwd"
    folder.mkdir()
    monkeypatch.chdir(folder)
    yield folder
    assert not list(folder.rglob("*"))


def test_every_command_checks_its_arguments_and_every_place_is_known() -> None:
    for name, command in COMMANDS.items():
        assert isinstance(command, CheckedCommand), name
        for parameter in command.params:
            if "Path" in repr(parameter.type_descriptor.annotation):
                assert parameter.name in PLACES, f"{name} {parameter.name}"
    assert len(parameters(is_number)) >= 20


def test_limits_that_are_written_twice_are_the_same() -> None:
    assert (options.LARGEST_SEED, options.MOST_JOBS) == (LARGEST_SEED, MOST_SLOTS)
    limits = {parameter.name: parameter.type_descriptor.parameter_info.max for parameter in COMMANDS["layout"].params}
    assert (limits["stacked"], limits["contained"]) == (MOST_OBJECTS, MOST_OBJECTS)


@pytest.mark.parametrize(("command", "parameter"), parameters(is_number))
def test_numbers_have_a_range(
    command: str, parameter: Any, empty: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for value in WRONG_NUMBERS:
        status, said = run(monkeypatch, capsys, *placed(command, parameter, value, empty))
        assert status == 2, (value[:40], said)
        check_one_line(said, command)
        assert parameter.opts[0].lstrip("-").split("-")[0] in said, said


def bad_places(folder: Path) -> dict[str, str]:
    return {
        "empty": "",
        "blank": "   ",
        "NUL": "a\0b",
        "surrogate": "a\ud800b",
        "latin-1": os.fsdecode(b"caf\xe9/none"),
        "long": "a" * (LONGEST_PLACE + 1),
        "long name": "a" * 300,
        "control": "no\x1b[31m\u202e\rsuch",
        "below a file": str(folder / "file.txt" / "x"),
        "loop": str(folder / "loop"),
        "pipe": str(folder / "pipe.toml"),
        "device": "/dev/full",
    }


@pytest.mark.parametrize("kind", sorted(bad_places(Path())))
@pytest.mark.parametrize(
    ("command", "parameter"),
    parameters(lambda parameter: parameter.name in PLACES),
)
def test_places_that_are_none_are_refused(
    command: str,
    parameter: Any,
    kind: str,
    tmp_path: Path,
    empty: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if parameter.name == "log" and kind in ("control", "latin-1"):
        pytest.skip("a file may have that name, and what is refused is told in it")
    (tmp_path / "file.txt").write_text("x")
    (tmp_path / "loop").symlink_to("loop")
    os.mkfifo(tmp_path / "pipe.toml")
    status, said = run(monkeypatch, capsys, *placed(command, parameter, bad_places(tmp_path)[kind], empty))
    assert status == 2, said
    check_one_line(said, command)


@pytest.mark.parametrize(
    "value", ["x" * 100_001, "a\0b", "\x1b[31m\u202ex", "[red]x", "x" * 10_000], ids=lambda v: ascii(v[:8])
)
@pytest.mark.parametrize(
    ("command", "parameter"),
    [
        each
        for each in parameters(lambda p: not is_number(p) and p.name not in PLACES and not getattr(p, "is_flag", False))
        if each.values[0] not in SERVES
    ],
)
def test_texts_of_any_kind_are_one_line(
    command: str,
    parameter: Any,
    value: str,
    empty: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    status, said = run(monkeypatch, capsys, *placed(command, parameter, value, empty))
    assert status == 2, said
    check_one_line(said, command)


@pytest.mark.parametrize(
    "objects", ["3..2", "0..3", "-1", "..", "1..10000000000", "x..y", "", "3..", "1e3", "1..\x1b[2J"]
)
def test_ranges_of_objects_say_what_is_valid(
    objects: str, empty: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    if objects == "3..":
        pytest.skip("is 3..3")
    arguments = ["layout", str(tmp_path), "-o", str(tmp_path / "out"), f"--objects={objects}"]
    status, said = run(monkeypatch, capsys, *arguments)
    assert status == 2 and "LOW..HIGH" in said
    check_one_line(said, "layout")


def test_an_option_of_one_value_is_given_once(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["export", "TWIN", "--to", "mjcf", "--to", "urdf", "--out", str(tmp_path / "out")])
    assert isinstance(result.exception, UsageError)
    assert str(result.exception) == "--to: given 2 times; this option takes one value, give it once"
    assert not (tmp_path / "out").exists()


def test_an_option_of_several_values_and_a_flag_may_be_given_again(tmp_path: Path) -> None:
    words = [
        "build",
        str(tmp_path / "no.glb"),
        "--out",
        "x",
        "-q",
        "-q",
        "--gripper",
        "panda",
        "--gripper",
        "wsg50_110",
    ]
    result = CliRunner().invoke(app, words)
    assert "times" not in str(result.exception) and "not found" in str(result.exception)
