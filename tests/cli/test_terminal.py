"""Nothing that others wrote is obeyed by the terminal: names of files, answers of servers, errors, warnings, logs."""

from __future__ import annotations

import csv
import io
import json
import logging
import re
import sys
import warnings
from pathlib import Path

import pytest
from rich.console import Console
from rich.table import Table
from rich.text import Text

import manitwin.cli.main as main_module
from manitwin.cli.console import LoggedConsole, escape_cell_text, write_json, write_text
from manitwin.cli.run_log import RedactingFormatter
from manitwin.cli.terminal import escape_terminal_output
from manitwin.errors import InputError, TwinError, encodable
from manitwin.formats.printable import printable_json

HOSTILE = (
    "\x1b[31mred",
    "\x1b]0;title\x07",
    "\x1b]8;;http://evil\x1b\\link",
    "a\rb",
    "a\x08\x08b",
    "\x9b31m",
    "\u202egnp.exe",
    "\u2066x\u2069",
    "\udce9.obj",
    "\x00",
    "\x7f",
    "[red]x[/red][link=http://evil]y",
    "[/]",
)
OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


def console(**options: object) -> tuple[LoggedConsole, io.StringIO]:
    stream = io.StringIO()
    return LoggedConsole(logging.INFO, file=stream, width=200, **options), stream  # type: ignore[arg-type]


@pytest.mark.parametrize("text", HOSTILE, ids=ascii)
def test_console_escapes_texts_tables_and_cells_and_reads_no_markup(text: str) -> None:
    shown, stream = console()
    shown.print(f"a {text} b", style="red")
    if text.startswith("["):
        assert stream.getvalue() == f"a {text} b\n", "markup is shown as it was written"
    table = Table(box=None)
    table.add_row(Text(text), escape_cell_text(text))
    shown.print(table)
    said = stream.getvalue()
    assert not OBEYED.search(said)


def test_a_text_is_one_line_and_a_paragraph_has_its_own() -> None:
    shown, stream = console()
    shown.print("a\nb\tc")
    shown.print("a\nb", paragraph=True)
    assert stream.getvalue() == "a\\nb\\tc\na\nb\n"


def test_colours_of_our_own_still_reach_a_terminal() -> None:
    shown, stream = console(force_terminal=True, color_system="standard", no_color=False)
    shown.print("\x1b[31mx", style="green")
    assert stream.getvalue() == "\x1b[32m\\x1b[31mx\x1b[0m\n"
    assert isinstance(shown, Console)


@pytest.mark.parametrize("text", HOSTILE, ids=ascii)
def test_what_goes_straight_to_stdout_is_escaped_and_json_keeps_its_value(
    text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    write_text(f"{text}\n")
    assert not OBEYED.search(capsys.readouterr().out)
    for ascii_only in (True, False):
        written = json.dumps({text: [text]}, ensure_ascii=ascii_only)
        write_json(written)
        said = capsys.readouterr().out
        assert not OBEYED.search(said)
        assert json.loads(said) == {text: [text]}
    assert json.loads(printable_json(json.dumps("\U000e0041 é", ensure_ascii=False))) == "\U000e0041 é"


@pytest.mark.parametrize("text", HOSTILE, ids=ascii)
def test_errors_are_one_escaped_line_that_utf8_has(
    text: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    for arguments in (["show", f"x{text}"], ["show", f"--x{text}"], [f"x{text}"], ["query", "a", "--table", text]):
        monkeypatch.setattr(sys, "argv", ["manitwin", *arguments])
        assert main_module._run() == 2
        said = capsys.readouterr().err
        assert len(said.splitlines()) == 1 and not OBEYED.search(said), said
    str(TwinError(text)).encode()
    str(InputError("unreadable", text)).encode()
    assert encodable("café \udce9") == "café \\udce9"


@pytest.mark.parametrize("text", HOSTILE, ids=ascii)
def test_log_of_a_run_and_logs_of_libraries_are_escaped(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    record = logging.LogRecord("manitwin", logging.INFO, "x.py", 1, "%s\nforged line", (text,), None)
    said = RedactingFormatter().format(record)
    assert not OBEYED.search(said)
    assert said.split("\n")[1] == "    forged line"


def test_warnings_and_tracebacks_of_python_are_escaped(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(warnings, "formatwarning", warnings.formatwarning)
    monkeypatch.setattr(sys, "excepthook", sys.excepthook)
    escape_terminal_output()
    assert not OBEYED.search(warnings.formatwarning("\x1b[2J", UserWarning, "a\x9b.py", 3, None))
    try:
        raise ValueError("\x1b[2J\u202e")
    except ValueError as error:
        sys.excepthook(ValueError, error, error.__traceback__)
    said = capsys.readouterr().err
    assert "\\x1b[2J\\u202e" in said and not OBEYED.search(said)
    last_resort = logging.lastResort
    assert last_resort is not None
    assert last_resort.format(logging.LogRecord("x", 30, "x.py", 1, "\x1b[2J", (), None)) == "\\x1b[2J"


def test_rows_of_a_query_are_escaped_in_every_format(capsys: pytest.CaptureFixture[str]) -> None:
    import pyarrow as pa

    from manitwin.cli.commands.query import WRITERS

    values = [text for text in HOSTILE if text == encodable(text)] + ["=1+1", "+x", "-x", "@x"]
    rows = pa.table({"twin_id": values, "name": values})
    for name, write in WRITERS.items():
        write(rows, write_json if name == "json" else write_text)
        said = capsys.readouterr().out
        assert not OBEYED.search(said), name
        if name == "json":
            assert [row["name"] for row in json.loads(said)] == values
        if name == "csv":
            assert [row["name"] for row in csv.DictReader(io.StringIO(said))][-4:] == values[-4:]
