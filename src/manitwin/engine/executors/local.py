"""Do jobs on this machine: a pool of processes for each resource, in which a crash or a hang costs one job."""

from __future__ import annotations

import faulthandler
import os
import queue
import signal
import tempfile
import time
from concurrent.futures import CancelledError, TimeoutError
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

from pebble import ProcessExpired, ProcessPool

from manitwin.config import Resource, RunConfig
from manitwin.engine.executors.child_processes import die_with, spared_from_interrupts
from manitwin.engine.executors.one_thread import one_thread_each
from manitwin.engine.executors.part_notes import EVERY_S, drop_note, parts_noted, read_notes
from manitwin.engine.jobs import Failure, Job, Reply, RunStage, WorkerSetup
from manitwin.engine.main_module import WorkerContext, hidden_main_module
from manitwin.engine.stage import StagePart
from manitwin.engine.worker import Worker

JOBS_A_PROCESS = 2000  # then a fresh one: what native code leaks stays bounded
STACK_LINES = 12


class LocalExecutor:
    """One process pool a resource, made when it is first needed; one process for all of them where there is one item.

    ``items`` is how many there are to do (None: many): no pool gets more processes, each of which imports the stages for seconds.

    Owns: the pools, and a folder for what dying workers leave behind.
    """

    def __init__(self, setup: WorkerSetup, settings: RunConfig, items: int | None = None):
        self._setup, self._settings, self._one_pool = setup, settings, items is not None and items <= 1
        cpu = settings.cpu or len(os.sched_getaffinity(0))
        wanted: dict[Resource, int] = {
            "cpu": cpu, "gpu": settings.gpu, "vlm": settings.vlm, "generator": settings.generator
        }  # fmt: skip
        self._slots = {needs: slots if items is None else max(1, min(slots, items)) for needs, slots in wanted.items()}
        self._pools: dict[Resource, ProcessPool] = {}
        self._ended: queue.SimpleQueue[tuple[int, Reply]] = queue.SimpleQueue()
        self._stacks = tempfile.TemporaryDirectory(prefix="manitwin-")
        self._looked_at = 0.0
        self._main = hidden_main_module()
        self._main.__enter__()

    def __enter__(self) -> LocalExecutor:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def slots(self, needs: Resource) -> int:
        """Return how many jobs of a resource run at a time."""
        return self._slots[needs]

    def submit(self, ticket: int, job: Job) -> None:
        """Give a job to the pool of what it needs."""
        with spared_from_interrupts():
            future = self._pool(job.needs).schedule(_do, args=(ticket, job), timeout=self._settings.stage_timeout_s)
        future.add_done_callback(partial(self._hand_over, ticket))

    def ended(self, timeout_s: float) -> list[tuple[int, Reply]]:
        """Wait for the next job that ends, and return all that have."""
        ended = []
        try:
            ended.append(self._ended.get(timeout=timeout_s))
            while True:
                ended.append(self._ended.get_nowait())
        except queue.Empty:
            return ended

    def parts(self) -> dict[int, StagePart]:
        """Return what the workers have left beside their stacks, once a second."""
        if time.monotonic() - self._looked_at < EVERY_S:
            return {}
        self._looked_at = time.monotonic()
        return read_notes(Path(self._stacks.name))

    def close(self) -> None:
        """Stop all processes at once."""
        for pool in self._pools.values():
            pool.stop()
            pool.join()
        self._pools.clear()
        self._stacks.cleanup()
        self._main.__exit__(None, None, None)

    def _pool(self, needs: Resource) -> ProcessPool:
        needs = "cpu" if self._one_pool else needs
        if needs not in self._pools:
            self._pools[needs] = ProcessPool(
                max_workers=self._slots[needs],
                max_tasks=JOBS_A_PROCESS,
                context=WorkerContext(),
                initializer=_start,
                initargs=(self._setup, self._stacks.name, os.getpid()),
            )
        return self._pools[needs]

    def _hand_over(self, ticket: int, future: Any) -> None:
        drop_note(Path(self._stacks.name), ticket)  # of a worker that died, or was ended as it took too long
        self._ended.put((ticket, self._reply(future)))

    def _reply(self, future: Any) -> Reply:
        try:
            reply: Reply = future.result()
            return reply
        except ProcessExpired as error:
            return Failure("died", f"the worker process died ({_how(error.exitcode)}){self._stack(error.pid)}")
        except TimeoutError:
            limit = self._settings.stage_timeout_s
            return Failure("timeout", f"took longer than run.stage_timeout_s = {limit:g} s")
        except CancelledError:
            return Failure("died", "cut off as the run was stopped")
        except Exception as error:  # what cannot be sent back, say: the other jobs go on
            return Failure("error", " ".join(f"{type(error).__name__}: {error}".split()))

    def _stack(self, pid: int | None) -> str:
        """Return the innermost lines of where a dying process was, where it could still say so."""
        path = Path(self._stacks.name) / f"{pid}.txt"
        lines = path.read_text(errors="replace").splitlines() if path.is_file() else []
        calls = [line.strip() for line in lines if line.startswith("  File")][:STACK_LINES]
        return "; it was at " + " < ".join(calls) if calls else ""


def _how(exit_code: int | None) -> str:
    if exit_code is not None and exit_code < 0:
        return signal.Signals(-exit_code).name
    return f"exit code {exit_code}"


_worker: Worker | None = None
_stack_file: TextIO | None = None


def _start(setup: WorkerSetup, stacks: str, driver: int) -> None:
    global _worker, _stack_file
    one_thread_each()
    die_with(driver)
    _stack_file = (Path(stacks) / f"{os.getpid()}.txt").open("w")
    faulthandler.enable(_stack_file)
    _worker = Worker(setup)


def _do(ticket: int, job: Job) -> Reply:
    assert _worker is not None and _stack_file is not None
    if not isinstance(job, RunStage):
        return _worker.do(job)
    with parts_noted(Path(_stack_file.name).parent, ticket):
        return _worker.do(job)
