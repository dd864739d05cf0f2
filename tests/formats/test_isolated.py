from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from manitwin.errors import AssetError, InputError, Unavailable
from manitwin.formats.isolated import (
    MAX_MEMORY_BYTES,
    Limits,
    ProcessCrashed,
    ProcessTimeout,
    iterate_isolated,
    run_isolated,
)
from manitwin.formats.json_file import read_json_object
from manitwin.formats.meshes.read import read_mesh


def test_results_and_errors_come_back_from_another_process(tmp_path: Path) -> None:
    assert run_isolated("os:getpid") == run_isolated("os:getpid") != os.getpid()
    with pytest.raises(AssetError, match=r"gone\.json"):
        run_isolated(f"{read_json_object.__module__}:read_json_object", tmp_path / "gone.json")
    (tmp_path / "empty.obj").write_text("")
    with pytest.raises(InputError) as caught:
        run_isolated(f"{read_mesh.__module__}:read_mesh", tmp_path / "empty.obj")
    assert caught.value.reason == "empty"
    with pytest.raises(ZeroDivisionError) as zero:
        run_isolated("operator:truediv", 1, 0)
    assert "_answer" in "".join(zero.value.__notes__)


def test_a_crash_ends_the_worker_and_not_this_process() -> None:
    before = run_isolated("os:getpid")
    with pytest.raises(ProcessCrashed, match="os:abort has crashed its process"):
        run_isolated("os:abort")
    assert run_isolated("os:getpid") != before


def test_what_asks_for_too_much_memory_is_told_so_and_the_worker_goes_on() -> None:
    before = run_isolated("os:getpid")
    with pytest.raises(MemoryError):
        run_isolated("builtins:bytearray", 2 * MAX_MEMORY_BYTES)
    assert run_isolated("os:getpid") == before


def test_nothing_that_is_printed_comes_between_the_answers() -> None:
    assert run_isolated("builtins:print", "not an answer") is None
    assert run_isolated("os:write", 1, b"not an answer") == 13


def test_threads_get_their_own_answers() -> None:
    answers: dict[int, int] = {}
    threads = [
        threading.Thread(target=lambda n=n: answers.update({n: run_isolated("builtins:abs", -n)})) for n in range(8)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert answers == {n: n for n in range(8)}


def test_a_forked_process_starts_a_worker_of_its_own() -> None:
    mine = run_isolated("os:getpid")
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(writer, str(run_isolated("os:getpid")).encode())
        os._exit(0)
    os.waitpid(child, 0)
    assert int(os.read(reader, 32)) != mine
    assert run_isolated("os:getpid") == mine


@pytest.mark.parametrize(
    ("function", "arguments"), [("time:sleep", (1000,)), ("re:match", ("(a+)+b", "a" * 64)), ("os:read", (0, 1))]
)
def test_a_call_that_does_not_end_is_ended(function: str, arguments: tuple[object, ...]) -> None:
    limits = Limits(seconds=0.5)
    with pytest.raises(ProcessTimeout, match=rf"{function} took longer than 0.5 s"):
        run_isolated(function, *arguments, limits=limits)
    assert run_isolated("builtins:abs", -1, limits=limits) == 1


def test_each_call_has_a_memory_limit_of_its_own() -> None:
    with pytest.raises(MemoryError):
        run_isolated("builtins:bytearray", 1 << 30, limits=Limits(memory_bytes=1 << 29))
    assert len(run_isolated("builtins:bytearray", 1 << 29, limits=Limits(memory_bytes=4 << 30))) == 1 << 29


def test_many_calls_are_answered_in_order_and_one_costs_itself_alone() -> None:
    # 1 ends its process as a whole: of a signal whose default is that, 0 none
    numbers = [*range(-3, 0), *([0] * 600), 11, *([0] * 5), 11, 0]
    answers = list(iterate_isolated("signal:raise_signal", numbers, Limits(seconds=5)))
    assert [number for number, _ in answers] == numbers
    assert all(not returned and isinstance(value, OSError) for _, (returned, value) in answers[:3])
    crashed = [n for n, (returned, value) in answers if not returned and isinstance(value, ProcessCrashed)]
    assert crashed == [11, 11]
    assert sum(returned for _, (returned, _) in answers) == 606


def test_a_slow_call_among_many_is_told_from_its_neighbours() -> None:
    answers = list(iterate_isolated("time:sleep", [0.0] * 300 + [0.2, 1000.0, 0.0], Limits(seconds=0.5)))
    assert [isinstance(value, ProcessTimeout) for _, (_, value) in answers] == [False] * 301 + [True, False]


def test_a_worker_that_somebody_killed_is_replaced() -> None:
    os.kill(run_isolated("os:getpid"), signal.SIGKILL)
    while True:  # until it is gone
        with contextlib.suppress(ProcessCrashed):
            assert run_isolated("builtins:abs", -2) == 2
            break


def test_an_interrupted_call_leaves_no_answer_for_the_next_one(monkeypatch: pytest.MonkeyPatch) -> None:
    before = run_isolated("os:getpid")
    previous = signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(KeyboardInterrupt):
            run_isolated("time:sleep", 1000)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
    assert run_isolated("builtins:abs", -7) == 7
    assert run_isolated("os:getpid") != before


def test_the_process_outlives_nobody() -> None:
    program = """
import os, sys
from manitwin.formats.isolated import Limits, run_isolated
print(run_isolated("os:getpid"), flush=True)
os.kill(os.getpid(), 9)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    until = time.monotonic() + 30
    while Path(f"/proc/{done.stdout.strip()}").exists():
        assert time.monotonic() < until
        time.sleep(0.02)


def test_where_no_process_can_be_started_it_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    with contextlib.suppress(ProcessCrashed):
        run_isolated("os:abort")

    def refused(*arguments: object, **options: object) -> None:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr("manitwin.formats.isolated.subprocess.Popen", refused)
    with pytest.raises(Unavailable, match=r"does not start .Resource temporarily unavailable.; check the limits"):
        run_isolated("os:getpid")


def test_relative_paths_begin_where_the_caller_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        assert run_isolated("os:getcwd") == str(tmp_path / name)
