"""Signals that come while something is done that may not be left in the middle."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from manitwin.engine.interrupts import SIGNALS, deferred_interrupts, is_deferred

HANGS_AFTER_S = 100


def test_an_interrupt_waits_for_the_end_of_what_may_not_be_left() -> None:
    before = [signal.getsignal(number) for number in SIGNALS]
    done = []
    with pytest.raises(KeyboardInterrupt), deferred_interrupts():
        signal.raise_signal(signal.SIGINT)
        done.append(is_deferred())
    assert done == [True] and not is_deferred()
    assert [signal.getsignal(number) for number in SIGNALS] == before


def test_an_interrupt_in_a_nested_statement_waits_for_the_outer_one() -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), deferred_interrupts():
        with deferred_interrupts():
            signal.raise_signal(signal.SIGINT)
        done.append(is_deferred())
    assert done == [True] and not is_deferred()


def test_a_second_interrupt_is_not_put_off() -> None:
    seen = []
    before = signal.signal(signal.SIGINT, lambda number, frame: seen.append(number))
    try:
        with deferred_interrupts():
            signal.raise_signal(signal.SIGINT)
            assert seen == []
            signal.raise_signal(signal.SIGINT)
            assert seen == [signal.SIGINT] * 2, "both handlers are called"
        assert len(seen) == 2
    finally:
        signal.signal(signal.SIGINT, before)


def test_an_interrupt_is_not_lost_where_what_was_done_fails() -> None:
    with pytest.raises(KeyboardInterrupt) as caught, deferred_interrupts():
        signal.raise_signal(signal.SIGINT)
        raise ValueError("failed")
    assert isinstance(caught.value.__context__, ValueError) and not is_deferred()


def test_a_signal_that_is_ignored_or_ends_the_process_is_left_as_it_is() -> None:
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with deferred_interrupts():
            assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
            signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)


def test_other_threads_have_no_handlers_to_put_off() -> None:
    found: list[object] = []

    def look() -> None:
        with deferred_interrupts():
            found.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert found == [signal.getsignal(signal.SIGINT)]


INTERRUPTED_WITH_A_LOCK = """
import signal, threading
from concurrent.futures import Future
from queue import Queue

class Interrupting(threading.Condition):
    '''A condition whose lock has just been taken, or is about to be given back, as an interrupt comes.'''

    armed = False

    def __enter__(self):
        entered = super().__enter__()
        self.interrupt("taken")
        return entered

    def __exit__(self, *error):
        self.interrupt("given back")
        return super().__exit__(*error)

    def interrupt(self, where):
        if Interrupting.armed == where and threading.current_thread() is threading.main_thread():
            Interrupting.armed = False
            signal.raise_signal(signal.SIGINT)

threading.Condition = Interrupting
from manitwin.engine.worker_pool import WorkerPool

def interrupted(where, do):
    Interrupting.armed = where
    try:
        do()
    except KeyboardInterrupt:
        print("interrupted", flush=True)

for where in ("taken", "given back"):
    pool = WorkerPool(1)
    first = pool.schedule(abs, (-1,))
    interrupted(where, lambda: pool.schedule(abs, (-2,)))
    interrupted(where, lambda: pool.result(first))
    print(pool.result(pool.schedule(abs, (-3,))), flush=True)
    pool.stop()
"""


def test_an_interrupt_as_a_pool_holds_a_lock_does_not_hold_it_for_ever() -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_WITH_A_LOCK], capture_output=True, text=True, timeout=HANGS_AFTER_S
    )
    assert done.stdout.split() == ["interrupted", "interrupted", "3"] * 2, done.stderr
    assert done.returncode == 0 and not done.stderr


LEFT_OPEN = """
import atexit, multiprocessing, sys
from manitwin.config import RunConfig
from manitwin.engine.executors.local import LocalExecutor
from manitwin.engine.jobs import WorkerSetup, WriteTables
from rehearsal_recipe import RehearsalRecipe

def tell():
    print(len(multiprocessing.active_children()), flush=True)

atexit.register(tell)  # called after what is registered later, and before what pebble and multiprocessing have registered
executor = LocalExecutor(WorkerSetup(sys.argv[1], RehearsalRecipe(files={}), None, False), RunConfig(cpu=1))
executor.submit(0, WriteTables(()))
executor.ended(60)
tell()
"""


def test_workers_of_a_run_that_an_interrupt_keeps_from_closing_end_as_the_program_does(tmp_path: Path) -> None:
    places = filter(None, (str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH")))
    done = subprocess.run(
        [sys.executable, "-c", LEFT_OPEN, str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=HANGS_AFTER_S,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(places)},
    )
    assert done.returncode == 0 and done.stdout.split() == ["1", "0"], done.stderr


@pytest.mark.skipif(
    not sys.platform.startswith("linux") or sys.version_info >= (3, 14), reason="workers are spawned there"
)
@pytest.mark.parametrize("where", ["after_in_child", "after_in_parent"])
def test_an_interrupt_as_the_server_of_workers_is_forked_is_the_programs_alone(where: str) -> None:
    program = f"""
import os, signal, sys
from manitwin.engine.fork_server import forked_workers
os.register_at_fork({where}=lambda: signal.raise_signal(signal.SIGINT))
try:
    with forked_workers([]):
        print("within", flush=True)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=HANGS_AFTER_S)
    expected = ["within"] if where == "after_in_child" else ["interrupted"]
    assert (done.returncode, done.stdout.split(), done.stderr) == (0, expected, "")
