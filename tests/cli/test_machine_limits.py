"""Limits of a shell, a disk and of names: one line, and no traceback."""

from __future__ import annotations

import errno
import resource
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from manitwin.cli import main
from manitwin.cli.interrupt import Interrupts
from manitwin.cli.machine_limits import machine_error_message, memory_limit_message
from manitwin.cli.main import app
from manitwin.errors import UsageError
from manitwin.pipeline.manifest import Notes, iterate_items
from manitwin.pipeline.manifest_item import LONGEST

MIB = 1 << 20


def manitwin(*arguments: str | Path, limit: int, value: int) -> subprocess.CompletedProcess[str]:
    """Run the command under a limit of its own."""
    program = (
        f"import resource; resource.setrlimit({limit}, ({value}, {value})); from manitwin.cli.entry import main; main()"
    )
    command = [sys.executable, "-c", program, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize("mib", [400, 1024, 3000])
@pytest.mark.parametrize("command", [("build", "x.obj", "-o", "out"), ("stats", "data"), ("query", "data", "1")])
def test_too_little_memory_is_told_before_anything_is_imported(command: tuple[str, ...], mib: int) -> None:
    done = manitwin(*command, limit=resource.RLIMIT_AS, value=mib * MIB)
    assert done.returncode == 2 and done.stdout == ""
    assert (
        done.stderr.count("\n") == 1 and "(ulimit -v)" in done.stderr and "are needed; raise that limit" in done.stderr
    )


def test_help_needs_no_memory_to_speak_of() -> None:
    assert manitwin("build", "--help", limit=resource.RLIMIT_AS, value=400 * MIB).returncode == 0
    assert manitwin("--version", limit=resource.RLIMIT_AS, value=400 * MIB).returncode == 0
    assert memory_limit_message(["build", "x"]) is None, "no limit here"


def test_a_limit_of_file_sizes_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "cup.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    done = manitwin(
        "build", tmp_path / "cup.obj", "-o", tmp_path / "out", "--executor", "inline", limit=resource.RLIMIT_FSIZE,
        value=2_000,
    )  # fmt: skip
    assert done.returncode in (2, 4), done.stderr
    assert "Traceback" not in done.stderr and "disk I/O error" in done.stderr.splitlines()[-1]


@pytest.mark.parametrize(
    ("error", "says", "status"),
    [
        (MemoryError(), "out of memory", 4),
        (OSError(errno.ENOSPC, "No space left on device", "/d/x"), "/d/x: No space left on device; free disk space", 4),
        (OSError(errno.EDQUOT, "Disk quota exceeded"), "Disk quota exceeded; free disk space", 4),
        (OSError(errno.EFBIG, "File too large", b"/d/\xff"), "ulimit -f", 4),
        (OSError(errno.EMFILE, "Too many open files"), "ulimit -n", 4),
        (BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable"), "ulimit -u", 4),
        (OSError(errno.EROFS, "Read-only file system", "/d"), "check the path", 2),
        (PermissionError(errno.EACCES, "Permission denied", "/d"), "check the path", 2),
        (OSError(errno.ENAMETOOLONG, "File name too long", "x" * 300), "check the path", 2),
        (sqlite3.OperationalError("disk I/O error"), "the ledger cannot be written (disk I/O error)", 4),
        (RuntimeError("can't start new thread"), "no thread can be started", 4),
    ],
)
def test_what_the_machine_refuses_is_told_with_its_remedy(error: Exception, says: str, status: int) -> None:
    found = machine_error_message(error)
    assert found is not None and says in found[0] and found[1] == status


def test_what_the_system_refuses_a_command_is_told_with_its_own_remedy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refused(*_: object) -> None:
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(main, "only_asked_for", refused)
    monkeypatch.setattr(main, "_interrupts", Interrupts(), raising=False)
    assert main._run() == 4
    errors = capsys.readouterr().err
    assert "ulimit -n" in errors and "disk space" not in errors and len(errors.splitlines()) == 1


@pytest.mark.parametrize("error", [ValueError("x"), RuntimeError("x"), OSError("x"), ConnectionResetError(104, "x")])
def test_defects_stay_defects(error: Exception) -> None:
    assert machine_error_message(error) is None


@pytest.mark.parametrize("key", [key for key in LONGEST if key not in ("file", "text")])
def test_what_is_said_of_an_input_has_a_longest(tmp_path: Path, key: str) -> None:
    (tmp_path / "cup.obj").write_text("v 0 0 0\n")
    with pytest.raises(UsageError, match=rf"{key}: 10000 characters; give at most {LONGEST[key]}"):
        list(iterate_items([tmp_path / "cup.obj"], {key: "x" * 10_000}, Notes()))


@pytest.mark.parametrize("name", ["x" * 5_000, "d/" * 3_000, "x" * 300 + ".obj", "\x1b[31m" * 100])
def test_paths_that_no_file_system_holds_are_one_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "list.csv").write_text(f"file\n{name}\n")
    for inputs in ([tmp_path / "list.csv"], [tmp_path / name]):
        with pytest.raises(UsageError) as caught:
            list(iterate_items(inputs, {}, Notes()))
        assert len(str(caught.value)) < 900 and "\x1b" not in str(caught.value)


def test_a_manifest_of_blank_lines_has_no_rows(tmp_path: Path) -> None:
    (tmp_path / "list.csv").write_text("file\n" + "\n" * 400_000)
    (tmp_path / "list.jsonl").write_text("\n" * 400_000)
    for name in ("list.csv", "list.jsonl"):
        with pytest.raises(UsageError, match="no rows"):
            list(iterate_items([tmp_path / name], {}, Notes()))


def test_a_name_of_ten_thousand_characters_is_refused_by_the_command(tmp_path: Path) -> None:
    (tmp_path / "cup.obj").write_text("v 0 0 0\n")
    done = CliRunner().invoke(
        app, ["build", str(tmp_path / "cup.obj"), "-o", str(tmp_path / "out"), "--name", "mug " * 2_500]
    )
    assert isinstance(done.exception, UsageError) and not (tmp_path / "out").exists()
