"""Limits of a worker on this machine: its memory, its time by a clock that nobody sets, and its end with the run."""

from __future__ import annotations

import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from rehearsals import rehearse

from manitwin.config import RunConfig
from manitwin.engine.drive import drive
from manitwin.engine.executors import local as local_module
from manitwin.engine.executors.local import LocalExecutor
from manitwin.engine.executors.local_worker import CrashReport
from manitwin.engine.jobs import Failure, Job, Reply, RunStage, StageRejected, WorkerSetup
from manitwin.engine.stage_runner import StageRun
from manitwin.engine.task import Task
from manitwin.errors import Unavailable
from manitwin.pipeline.item import Item
from manitwin.twin.dataset_root import DatasetRoot
from rehearsal_recipe import RehearsalRecipe

PATIENCE_S = 60.0


def setup(folder: Path, memory_gb: float = 0.0) -> WorkerSetup:
    return WorkerSetup(str(folder), RehearsalRecipe(), folder, False, memory_gb)


def job(text: str) -> Job:
    item = Item(file=None, text=text)
    return RunStage(Task(1, item, RehearsalRecipe().identify(item).item_id), "text", 0, "a", "cpu", ())


def wait(executor: LocalExecutor, until: Callable[[], bool] = lambda: False) -> list[tuple[int, Reply]]:
    """Return what has ended, or nothing once ``until`` is true."""
    limit = time.monotonic() + PATIENCE_S
    while time.monotonic() < limit:
        ended = executor.ended(0.05)
        if ended or until():
            return ended
    raise AssertionError("nothing ended")


def workers(executor: LocalExecutor) -> list[int]:
    return [process.pid or 0 for pool in executor._pools.values() for process in pool._context._started]


@pytest.mark.parametrize("text", ["eat:a:2", "bad_alloc:a"])
def test_what_needs_more_memory_than_a_worker_may_take_is_too_large(tmp_path: Path, text: str) -> None:
    with LocalExecutor(setup(tmp_path, 1.0), RunConfig(cpu=1)) as executor:
        executor.submit(1, job(text))
        ((_, reply),) = wait(executor)
        assert isinstance(reply, StageRejected) and reply.answer.reason == "too_large"
        assert re.search(
            "stage a needs more than run.memory_gb = 1 GB of memory; .*raise run.memory_gb", reply.answer.detail
        )
        executor.submit(2, job("another"))
        assert isinstance(wait(executor)[0][1], StageRun), "the run goes on"


@pytest.mark.slow
def test_without_a_limit_nothing_is_too_large(tmp_path: Path) -> None:
    with LocalExecutor(setup(tmp_path), RunConfig(cpu=1)) as executor:
        executor.submit(1, job("eat:a:2"))
        assert isinstance(wait(executor)[0][1], StageRun)


def test_an_item_that_is_too_large_is_rejected_in_a_run_of_processes(tmp_path: Path) -> None:
    report = drive(
        RehearsalRecipe(), [Item(file=None, text="eat:b:3"), Item(file=None, text="good")], DatasetRoot(tmp_path / "d"),
        RunConfig(cpu=2, memory_gb=1), configuration={},
    )  # fmt: skip
    assert (report.counts["rejected"], report.counts["accepted"], report.exit_code) == (1, 1, 3)


def test_programs_of_a_stage_are_not_limited_by_its_memory() -> None:
    program = """
import resource, subprocess, sys
from manitwin.engine.process_limits import limit_memory
from manitwin.models.generators import supervisor
before = resource.getrlimit(resource.RLIMIT_DATA)
limit_memory(1.5)
assert resource.getrlimit(resource.RLIMIT_DATA) == (3 << 29, before[1])
sys.exit(supervisor.supervise([sys.executable, "-c", "import resource as r; print(*r.getrlimit(r.RLIMIT_DATA))"]))
"""
    held, hold = os.pipe()  # the program is ended once nobody holds its standard input
    done = subprocess.run([sys.executable, "-c", program], stdin=held, capture_output=True, text=True, check=True)
    os.close(held)
    os.close(hold)
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    assert done.stdout.split() == [str(hard), str(hard)]


@pytest.mark.parametrize("text", ["hang:a", "stuck:a"])
def test_a_stage_that_does_not_end_is_cut_off(tmp_path: Path, text: str) -> None:
    with LocalExecutor(setup(tmp_path), RunConfig(cpu=1, stage_timeout_s=1)) as executor:
        executor.submit(1, job(text))
        ((_, reply),) = wait(executor)
        assert isinstance(reply, Failure) and reply.kind == "timeout" and "stage_timeout_s = 1 s" in reply.message
        executor.submit(2, job("another"))
        assert isinstance(wait(executor)[0][1], StageRun)


@pytest.mark.parametrize("jump_s", [pytest.param(-86_400.0, marks=pytest.mark.slow), 86_400.0])
def test_a_clock_that_is_set_ends_no_stage_and_spares_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, jump_s: float
) -> None:
    now, go_on = time.time, tmp_path / "go_on"
    with LocalExecutor(setup(tmp_path), RunConfig(cpu=1, stage_timeout_s=20)) as executor:
        executor.submit(1, job(f"parts:a:{go_on}"))
        assert not wait(executor, until=lambda: bool(executor.parts()))
        monkeypatch.setattr(time, "time", lambda: now() + jump_s)
        for _ in range(10):
            assert not executor.ended(0.05)
        go_on.touch()
        assert isinstance(wait(executor)[0][1], StageRun)
    with LocalExecutor(setup(tmp_path / "another"), RunConfig(cpu=1, stage_timeout_s=1)) as executor:
        executor.submit(1, job("hang:a"))
        assert isinstance(wait(executor)[0][1], Failure)


def test_time_in_which_the_driver_was_stopped_itself_does_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now, go_on = time.monotonic, tmp_path / "go_on"
    with LocalExecutor(setup(tmp_path), RunConfig(cpu=1, stage_timeout_s=100)) as executor:
        executor.submit(1, job(f"parts:a:{go_on}"))
        assert not wait(executor, until=lambda: bool(executor.parts()))
        monkeypatch.setattr(local_module.time, "monotonic", lambda: now() + 86_400)
        assert not executor.ended(0.05)
        go_on.touch()
        assert isinstance(wait(executor)[0][1], StageRun)


def test_stopped_workers_go_on_where_they_were_and_end_with_the_run(tmp_path: Path) -> None:
    go_on = tmp_path / "go_on"
    executor = LocalExecutor(setup(tmp_path), RunConfig(cpu=1))
    executor.submit(1, job(f"parts:a:{go_on}"))
    assert not wait(executor, until=lambda: bool(executor.parts()))
    pids = workers(executor)
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    go_on.touch()
    assert not executor.ended(0.5)
    for pid in pids:
        os.kill(pid, signal.SIGCONT)
    assert isinstance(wait(executor)[0][1], StageRun)
    executor.submit(2, job("hang:a"))
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    executor.close()
    assert pids and not [pid for pid in pids if Path(f"/proc/{pid}").exists()]


def test_a_pool_whose_processes_were_all_killed_while_idle_is_made_anew(tmp_path: Path) -> None:
    with LocalExecutor(setup(tmp_path), RunConfig(cpu=1)) as executor:
        executor.submit(1, job("first"))
        assert isinstance(wait(executor)[0][1], StageRun)
        for round_ in range(3):
            for pid in workers(executor):
                os.kill(pid, signal.SIGKILL)
            replies = []
            while not any(isinstance(reply, StageRun) for reply in replies):
                assert len(replies) < 5, replies
                executor.submit(10 * round_ + len(replies) + 2, job("again"))
                replies += [reply for _, reply in wait(executor)]


def test_workers_that_never_start_are_said_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # no folder to leave their last words in: each ends as it begins
    with LocalExecutor(setup(tmp_path), RunConfig(cpu=1)) as executor:
        gone = executor._stacks.name
        monkeypatch.setattr(executor._stacks, "name", str(tmp_path / "gone"))
        with pytest.raises(Unavailable, match="worker processes cannot be started"):
            for ticket in range(20):
                executor.submit(ticket, job("never"))
                ((_, reply),) = wait(executor)
                assert isinstance(reply, Failure) and reply.kind == "died"
        monkeypatch.setattr(executor._stacks, "name", gone)


def test_last_words_tell_memory_from_a_crash(tmp_path: Path) -> None:
    assert CrashReport.from_stack_file(tmp_path, 1) == CrashReport()
    (tmp_path / "2.txt").write_text(
        'LLVM ERROR: out of memory\nFatal Python error: Aborted\n\n  File "a.py", line 1 in f\n'
    )
    words = CrashReport.from_stack_file(tmp_path, 2)
    assert words == CrashReport("LLVM ERROR: out of memory", 'File "a.py", line 1 in f', no_memory=True)
    (tmp_path / "3.txt").write_text("\x1b[31mfree(): invalid pointer\nFatal Python error: Aborted\n")
    words = CrashReport.from_stack_file(tmp_path, 3)
    assert not words.no_memory and "invalid pointer" in words.said and "\x1b" not in words.said
    (tmp_path / "4.txt").write_text("Fatal Python error: Segmentation fault\nout of memory\n")
    assert not CrashReport.from_stack_file(tmp_path, 4).no_memory, "what stands in a stack is no cause"


def test_a_crash_names_stage_item_and_signal_and_the_run_goes_on(tmp_path: Path) -> None:
    texts = ["segfault:b", "good"]
    run = rehearse(
        tmp_path / "d", texts, recipe=RehearsalRecipe(), settings=RunConfig(cpu=1, attempts=1), processes=True
    )
    assert run.states == {"segfault:b": "failed", "good": "accepted"}
    assert "SIGSEGV" in (run.errors["segfault:b", "b"] or "")
