"""Ctrl-C once and twice, and SIGTERM: one line, no traceback, nobody left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

import manitwin.cli.commands.status as status_module
from manitwin.cli.main import app
from manitwin.engine.ledger.ledger import Ledger

PROGRAM = Path(__file__).with_name("interrupted_program.py")
PATIENCE_S = 120.0


class Interrupted:
    """A command in a process group of its own, as a terminal has it."""

    def __init__(self, folder: Path, name: str, mode: str):
        self.folder = folder
        command = [sys.executable, PROGRAM, name, folder, mode]
        self.process = subprocess.Popen(command, start_new_session=True, stderr=subprocess.PIPE, text=True)

    def wait_for(self, note: str) -> None:
        until = time.monotonic() + PATIENCE_S
        while not (self.folder / note).exists():
            assert self.process.poll() is None and time.monotonic() < until, self.process.communicate()
            time.sleep(0.01)

    def send(self, *numbers: signal.Signals) -> None:
        for number in numbers:
            os.killpg(self.process.pid, number)

    def end(self) -> tuple[int, list[str]]:
        """Return the exit status and the lines on stderr; no process of the group is left."""
        _, errors = self.process.communicate(timeout=PATIENCE_S)
        until = time.monotonic() + PATIENCE_S
        while _group_lives(self.process.pid):
            assert time.monotonic() < until, "a process is left behind"
            time.sleep(0.01)
        return self.process.returncode, errors.splitlines()


def _group_lives(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


AGAIN = "; rerun the same command to resume"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize(
    ("name", "status", "line"),
    [
        ("trajectories", 4, f"manitwin trajectories: interrupted{AGAIN}"),
        ("stats", 130, "manitwin stats: interrupted"),
    ],
)
def test_first_interrupt_ends_in_order_with_one_line(
    tmp_path: Path, name: str, status: int, line: str, number: signal.Signals
) -> None:
    program = Interrupted(tmp_path, name, "busy")
    program.wait_for("started")
    program.send(number)
    assert program.end() == (status, [line])
    assert (tmp_path / "ending").exists()


@pytest.mark.parametrize("numbers", [(signal.SIGINT, signal.SIGINT), (signal.SIGTERM, signal.SIGINT)])
@pytest.mark.parametrize(("name", "status"), [("render", 4), ("export", 130)])
def test_second_interrupt_ends_a_slow_end_at_once(
    tmp_path: Path, name: str, status: int, numbers: tuple[signal.Signals, signal.Signals]
) -> None:
    program = Interrupted(tmp_path, name, "slow")
    program.wait_for("started")
    program.send(numbers[0])
    program.wait_for("ending")
    program.send(numbers[1])
    found, lines = program.end()
    assert found == status and len(lines) == 1 and "interrupted" in lines[0]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_second_interrupt_ends_native_code_in_a_slow_end(tmp_path: Path, number: signal.Signals) -> None:
    program = Interrupted(tmp_path, "render", "deaf")
    program.wait_for("started")
    program.send(signal.SIGINT)
    program.wait_for("ending")
    program.send(number)
    assert program.end() == (4, [f"manitwin render: interrupted{AGAIN}"])


@pytest.mark.parametrize("where", ["lost", "import"])
def test_an_interrupt_that_is_dropped_or_caught_on_its_way_is_not_lost(tmp_path: Path, where: str) -> None:
    program = Interrupted(tmp_path, "layout", where)
    assert program.end() == (4, [f"manitwin layout: interrupted{AGAIN}"])
    assert (tmp_path / "ending").exists()


def test_second_interrupt_ends_an_import_at_once(tmp_path: Path) -> None:
    program = Interrupted(tmp_path, "layout", "imports")
    program.wait_for("importing")
    program.send(signal.SIGINT)
    program.send(signal.SIGTERM)
    assert program.end() == (4, [f"manitwin layout: interrupted{AGAIN}"])


def test_an_import_that_does_not_end_is_ended(tmp_path: Path) -> None:
    program = Interrupted(tmp_path, "layout", "imports")
    program.wait_for("importing")
    program.send(signal.SIGINT)
    assert program.end() == (4, [f"manitwin layout: interrupted{AGAIN}"])


@pytest.mark.parametrize("times", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
def test_interrupts_of_a_run_leave_no_worker_and_no_traceback(tmp_path: Path, times: int) -> None:
    program = Interrupted(tmp_path, "run", "run")
    program.wait_for("started")
    program.send(*[signal.SIGINT] * times)
    status, lines = program.end()
    assert status == 4
    assert [line for line in lines if "interrupted" in line] == [f"manitwin run: interrupted{AGAIN}"]
    assert len(lines) == 1, lines
    assert not list((tmp_path / "data" / "twins").glob("*/*")), "nothing is half-made"


def test_an_interrupt_is_how_a_watch_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Ledger(tmp_path / "ledger.sqlite").close()
    monkeypatch.setattr(status_module.time, "sleep", lambda seconds: signal.raise_signal(signal.SIGINT))
    done = CliRunner().invoke(app, ["status", str(tmp_path), "--watch"])
    assert done.exit_code == 0 and "0 of 0 items ended" in done.stdout
    assert "interrupted" not in done.output.lower() and "aborted" not in done.output.lower()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_native_code_that_does_not_return_is_ended_too(tmp_path: Path, number: signal.Signals) -> None:
    program = Interrupted(tmp_path, "stats", "native")
    program.wait_for("started")
    program.send(number)
    assert program.end() == (130, ["manitwin stats: interrupted"])


def test_a_server_that_waits_for_its_last_answers_ends_in_order(tmp_path: Path) -> None:
    program = Interrupted(tmp_path, "fake", "server")
    program.wait_for("started")
    program.send(signal.SIGINT)
    assert program.end() == (0, [])


@pytest.mark.parametrize("what", ["listing", "manifest", "inspection"])
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_build_that_looks_at_its_inputs_answers_signals(tmp_path: Path, what: str, number: signal.Signals) -> None:
    program = Interrupted(tmp_path, "build", what)
    program.wait_for("started")
    program.send(number)
    assert program.end() == (4, [f"manitwin build: interrupted{AGAIN}"])


def test_a_signal_that_is_ignored_stays_so(tmp_path: Path) -> None:
    program = (
        "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN); import runpy, sys; sys.argv = sys.argv[1:];"
        " runpy.run_path(sys.argv[0], run_name='__main__')"
    )
    command = [sys.executable, "-c", program, str(PROGRAM), "stats", str(tmp_path), "busy"]
    process = subprocess.Popen(command, start_new_session=True, stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + PATIENCE_S
    while not (tmp_path / "started").exists():
        assert process.poll() is None and time.monotonic() < until
        time.sleep(0.01)
    process.send_signal(signal.SIGHUP)
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130 and errors.splitlines() == ["manitwin stats: interrupted"]


@pytest.mark.parametrize(("name", "status"), [("layout", 4), ("export", 130)])
def test_interrupt_while_python_takes_itself_down_keeps_the_exit_status(tmp_path: Path, name: str, status: int) -> None:
    program = Interrupted(tmp_path, name, "late")
    program.wait_for("started")
    program.send(signal.SIGINT)
    found, lines = program.end()
    assert found == status and len(lines) == 1 and "interrupted" in lines[0]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_while_the_command_line_is_imported_is_one_line(number: signal.Signals) -> None:
    program = """
import os, sys
class Interrupts:
    def find_spec(self, name, *rest):
        if name == "manitwin.cli.main":
            os.kill(os.getpid(), int(sys.argv[1]))
sys.meta_path.insert(0, Interrupts())
from manitwin.cli.entry import main
main()
"""
    done = subprocess.run([sys.executable, "-c", program, str(int(number))], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "manitwin: interrupted\n")


def test_an_interrupted_command_does_its_exit_functions_and_takes_no_module_down(tmp_path: Path) -> None:
    program = """
import atexit, os, sys
import manitwin.cli.main as cli
class TakenDown:
    def __del__(self, write=os.write):
        write(1, b"taken down")
last = TakenDown()
def work():
    atexit.register(print, "an exit function")
    print("said", end=" ")
    os.kill(os.getpid(), 15)
cli.app.registered_commands = []
cli.app.command("run")(work)
cli.app.command("other")(work)
from manitwin.cli.entry import main
sys.argv[1:] = ["run"]
main()
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode in (4, 130) and "interrupted" in done.stderr
    assert done.stdout == "said an exit function\n"


def test_entry_imports_nothing_that_takes_time() -> None:
    program = "import sys; old = set(sys.modules); import manitwin.cli.entry; print(*sorted(set(sys.modules) - old))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert not {"multiprocessing", "typer", "rich", "asyncio", "importlib.metadata"} & set(done.stdout.split())


def test_package_runs_as_a_module() -> None:
    done = subprocess.run([sys.executable, "-m", "manitwin", "--version"], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.startswith("manitwin ")
