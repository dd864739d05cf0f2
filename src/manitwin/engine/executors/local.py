"""Do jobs on this machine: a pool of processes for each resource, in which a crash or a hang costs one job."""

from __future__ import annotations

import atexit
import logging
import os
import queue
import signal
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any

from pebble import ProcessExpired

from manitwin.config import Resource, RunConfig
from manitwin.engine.executors.local_worker import LastWords, do, start
from manitwin.engine.executors.stage_notes import EVERY_S, drop_note, read_notes
from manitwin.engine.interrupts import deferred_interrupts
from manitwin.engine.jobs import Failure, Job, Reply, RunStage, StageRejected, WorkerSetup
from manitwin.engine.machine_share import available_workers
from manitwin.engine.stage import StagePart
from manitwin.engine.stage_runner import StageCost
from manitwin.engine.worker import too_large
from manitwin.engine.worker_pool import WorkerPool
from manitwin.engine.worker_processes import hidden_main_module
from manitwin.errors import Unavailable

RUN = logging.getLogger("manitwin.run")
JOBS_A_PROCESS = 2000  # then a new process starts, which bounds what native code leaks
LONGEST_STEP_S = 5.0
"""At most so much of the time since the last look counts against a job: this process may itself have been stopped."""
FAILED_POOLS = 5  # in a row, without an answer in between: then it is the installation, not one crash


@dataclass
class _Given:
    """A job that was given to a pool, how long it has run, and whether that was too long."""

    job: Job
    future: Any = None
    seconds: float = 0.0
    late: bool = False


class LocalExecutor:
    """One process pool a resource, made when it is first needed; one process for all of them where there is one item.

    ``items`` is how many there are to do (None: many): no pool gets more processes, each of which imports the stages for seconds.
    ``tell`` is called with a line where memory allows less than a process a core.

    Owns: the pools, and a folder for what dying workers leave behind.
    """

    def __init__(
        self,
        setup: WorkerSetup,
        settings: RunConfig,
        items: int | None = None,
        *,
        tell: Callable[[str], None] = lambda line: None,
    ):
        self._setup, self._settings, self._one_pool = setup, settings, items is not None and items <= 1
        cpu = settings.cpu or available_workers(items, tell=tell)
        wanted: dict[Resource, int] = {
            "cpu": cpu, "gpu": settings.gpu, "vlm": settings.vlm, "generator": settings.generator
        }  # fmt: skip
        self._slots = {needs: slots if items is None else max(1, min(slots, items)) for needs, slots in wanted.items()}
        self._pools: dict[Resource, WorkerPool] = {}
        self._given: dict[int, _Given] = {}
        self._failed_pools = 0
        self._ended: queue.SimpleQueue[tuple[int, Reply]] = queue.SimpleQueue()
        self._stacks = tempfile.TemporaryDirectory(prefix="manitwin-")
        self._looked_at, self._counted_at = 0.0, time.monotonic()
        self._main = hidden_main_module()
        self._main.__enter__()
        atexit.register(self.close)  # an interrupt may come just before: a worker that nobody ends would be waited for

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
        with deferred_interrupts():
            given = _Given(job)
            given.future = self._schedule(ticket, given)
            self._given[ticket] = given

    def ended(self, timeout_s: float) -> list[tuple[int, Reply]]:
        """Wait for the next job that ends, and return all that have; end those that take too long."""
        ended = []
        try:
            ended.append(self._ended.get(timeout=timeout_s))
            while True:
                ended.append(self._ended.get_nowait())
        except queue.Empty:
            pass
        for ticket, _ in ended:
            self._given.pop(ticket, None)
        self._end_overdue()
        return ended

    def parts(self) -> dict[int, StagePart]:
        """Return what the workers have left beside their stacks, once a second."""
        if time.monotonic() - self._looked_at < EVERY_S:
            return {}
        self._looked_at = time.monotonic()
        return read_notes(Path(self._stacks.name))

    def close(self) -> None:
        """Stop all processes at once."""
        with deferred_interrupts():
            atexit.unregister(self.close)
            for pool in self._pools.values():
                pool.refuse()
            for pool in self._pools.values():
                pool.stop()
            self._pools.clear()
            self._stacks.cleanup()
            self._main.__exit__(None, None, None)

    def _schedule(self, ticket: int, given: _Given) -> Any:
        """Give a job to its pool; to a new one where all processes of the pool died before they had a job."""
        while True:
            pool = self._pool(given.job.needs)
            try:
                return pool.schedule(do, (ticket, given.job), on_end=partial(self._hand_over, ticket, given))
            except RuntimeError as error:  # pebble's, of a pool that is broken
                self._failed_pools += 1
                if self._failed_pools >= FAILED_POOLS:
                    raise Unavailable(
                        "the worker processes cannot be started, or end before they get a job; `manitwin doctor`"
                        " may find the cause, and more memory or fewer --jobs may help"
                    ) from error
                RUN.warning("all worker processes of a pool have died: new ones are started")
                self._pools = {needs: other for needs, other in self._pools.items() if other is not pool}
                pool.stop()

    def _end_overdue(self) -> None:
        """End the jobs that have run longer than they may. Time is monotonic: no clock that is set ends or spares one."""
        now = time.monotonic()
        step, self._counted_at = min(now - self._counted_at, LONGEST_STEP_S), now
        with deferred_interrupts():  # a future has a lock, which the threads of its pool want too
            for given in list(self._given.values()):
                if not given.late and given.future.running():
                    given.seconds += step
                    if given.seconds > self._settings.stage_timeout_s:
                        given.late = True
                        given.future.cancel()  # pebble ends its process

    def _pool(self, needs: Resource) -> WorkerPool:
        needs = "cpu" if self._one_pool else needs
        if needs not in self._pools:
            self._pools[needs] = WorkerPool(
                self._slots[needs],
                max_tasks=JOBS_A_PROCESS,
                initializer=start,
                initargs=(self._setup, self._stacks.name, os.getpid()),
            )
        return self._pools[needs]

    def _hand_over(self, ticket: int, given: _Given, future: Any) -> None:
        drop_note(Path(self._stacks.name), ticket)  # of a worker that died, or was ended as it took too long
        self._ended.put((ticket, self._reply(given, future)))

    def _reply(self, given: _Given, future: Any) -> Reply:
        try:
            reply: Reply = future.result()
            self._failed_pools = 0
            return reply
        except ProcessExpired as error:
            self._failed_pools = 0  # it had a job
            return self._died(given.job, error)
        except CancelledError:
            if not given.late:
                return Failure("died", "interrupted because the run was stopped")
            limit = self._settings.stage_timeout_s
            return Failure("timeout", f"took longer than run.stage_timeout_s = {limit:g} s")
        except BrokenProcessPool:
            return Failure("died", "all worker processes died while it waited for one; the next job starts new ones")
        except Exception as error:  # what cannot be sent back, say: the other jobs go on
            return Failure("error", " ".join(f"{type(error).__name__}: {error}".split()))

    def _died(self, job: Job, error: ProcessExpired) -> Reply:
        """Say how a process ended, in one line; an item that was refused memory is too large."""
        words = LastWords.read(Path(self._stacks.name), error.pid)
        if words.no_memory and isinstance(job, RunStage) and self._setup.recipe.can_reject:
            return StageRejected(too_large(job, self._setup.memory_gb), StageCost(0.0, 0.0, 0.0))
        how = _how(error.exitcode)
        said = f": {words.said}" if words.said else ""
        at = f"; it was at {words.calls}" if words.calls else ""
        limit = self._setup.memory_gb
        memory = f"; its limit is run.memory_gb = {limit:g} GB" if limit and words.no_memory else ""
        if error.exitcode == -signal.SIGKILL:
            memory = "; it was killed from outside, probably by the system because memory ran out; lower --jobs or run.memory_gb"
        return Failure("died", f"the worker process died ({how}{said}){memory}{at}")


def _how(exit_code: int | None) -> str:
    if exit_code is not None and exit_code < 0:
        return signal.Signals(-exit_code).name
    return f"exit code {exit_code}"
