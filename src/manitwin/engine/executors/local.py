"""Executor on this machine: one process pool per resource; a crash or hang costs one job."""

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
from manitwin.engine.executors.local_worker import CrashReport, initialize_worker, run_job
from manitwin.engine.executors.stage_progress import EVERY_S, drop_note, read_notes
from manitwin.engine.interrupts import deferred_interrupts
from manitwin.engine.jobs import Failure, Job, Reply, RunStage, StageRejected, WorkerSetup
from manitwin.engine.machine_resources import available_workers
from manitwin.engine.stage import StagePart
from manitwin.engine.stage_runner import StageCost
from manitwin.engine.worker import too_large
from manitwin.engine.worker_pool import WorkerPool
from manitwin.engine.worker_processes import hidden_main_module
from manitwin.errors import Unavailable

RUN = logging.getLogger("manitwin.run")
JOBS_A_PROCESS = 2000  # per process, to bound the memory that native code leaks
LONGEST_STEP_S = 5.0
"""The most time since the last check that counts towards a job's timeout: the driver itself may have been suspended."""
FAILED_POOLS = 5  # consecutive pool failures without an answer; the installation is then at fault, not a single crash


@dataclass
class _SubmittedJob:
    """A submitted job, its run time so far, and whether it exceeded the timeout."""

    job: Job
    future: Any = None
    seconds: float = 0.0
    late: bool = False


class LocalExecutor:
    """Executor with one process pool per resource, created on first use; a single pool serves all resources if there is one item.

    ``items`` is the number of items to process (None: many). It bounds the processes of a pool, because each process spends
    seconds on imports. ``tell`` is called with a message if memory allows fewer workers than cores. Owns the pools, and a
    temporary folder for the stack traces of dying workers.
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
        self._given: dict[int, _SubmittedJob] = {}
        self._failed_pools = 0
        self._ended: queue.SimpleQueue[tuple[int, Reply]] = queue.SimpleQueue()
        self._stacks = tempfile.TemporaryDirectory(prefix="manitwin-")
        self._looked_at, self._counted_at = 0.0, time.monotonic()
        self._main = hidden_main_module()
        self._main.__enter__()
        atexit.register(self.close)  # an interrupt may come before __enter__: exit would wait for the workers

    def __enter__(self) -> LocalExecutor:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def slots(self, needs: Resource) -> int:
        """Return how many jobs of a resource run concurrently."""
        return self._slots[needs]

    def submit(self, ticket: int, job: Job) -> None:
        """Submit a job to the pool of the resource it needs."""
        with deferred_interrupts():
            given = _SubmittedJob(job)
            given.future = self._schedule(ticket, given)
            self._given[ticket] = given

    def ended(self, timeout_s: float) -> list[tuple[int, Reply]]:
        """Wait for the next job that ends and return all ended jobs; cancel jobs that exceed the timeout."""
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
        """Return the progress notes of running stages by ticket; they are read at most once a second."""
        if time.monotonic() - self._looked_at < EVERY_S:
            return {}
        self._looked_at = time.monotonic()
        return read_notes(Path(self._stacks.name))

    def close(self) -> None:
        """Stop all processes immediately."""
        with deferred_interrupts():
            atexit.unregister(self.close)
            for pool in self._pools.values():
                pool.close_to_new_calls()
            for pool in self._pools.values():
                pool.stop()
            self._pools.clear()
            self._stacks.cleanup()
            self._main.__exit__(None, None, None)

    def _schedule(self, ticket: int, given: _SubmittedJob) -> Any:
        """Schedule a job in its pool; replace the pool if all of its processes died before they got a job."""
        while True:
            pool = self._pool(given.job.needs)
            try:
                return pool.schedule(run_job, (ticket, given.job), on_end=partial(self._queue_reply, ticket, given))
            except RuntimeError as error:  # raised by pebble for a broken pool
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
        """Cancel jobs that exceed the timeout. Monotonic time is used, so that setting the system clock has no effect."""
        now = time.monotonic()
        step, self._counted_at = min(now - self._counted_at, LONGEST_STEP_S), now
        with deferred_interrupts():  # a future has a lock that threads of its pool also take
            for given in list(self._given.values()):
                if not given.late and given.future.running():
                    given.seconds += step
                    if given.seconds > self._settings.stage_timeout_s:
                        given.late = True
                        given.future.cancel()  # pebble kills its process

    def _pool(self, needs: Resource) -> WorkerPool:
        needs = "cpu" if self._one_pool else needs
        if needs not in self._pools:
            self._pools[needs] = WorkerPool(
                self._slots[needs],
                max_tasks=JOBS_A_PROCESS,
                initializer=initialize_worker,
                initargs=(self._setup, self._stacks.name, os.getpid()),
            )
        return self._pools[needs]

    def _queue_reply(self, ticket: int, given: _SubmittedJob, future: Any) -> None:
        drop_note(Path(self._stacks.name), ticket)  # left by a worker that died or was killed on timeout
        self._ended.put((ticket, self._reply(given, future)))

    def _reply(self, given: _SubmittedJob, future: Any) -> Reply:
        try:
            reply: Reply = future.result()
            self._failed_pools = 0
            return reply
        except ProcessExpired as error:
            self._failed_pools = 0  # the process had started a job, so the pool works
            return self._death_reply(given.job, error)
        except CancelledError:
            if not given.late:
                return Failure("died", "interrupted because the run was stopped")
            limit = self._settings.stage_timeout_s
            return Failure("timeout", f"took longer than run.stage_timeout_s = {limit:g} s")
        except BrokenProcessPool:
            return Failure("died", "all worker processes died while it waited for one; the next job starts new ones")
        except Exception as error:  # e.g. a reply that cannot be pickled; the other jobs continue
            return Failure("error", " ".join(f"{type(error).__name__}: {error}".split()))

    def _death_reply(self, job: Job, error: ProcessExpired) -> Reply:
        """Describe in one line how a process died; reject the item as too large if it ran out of memory."""
        words = CrashReport.from_stack_file(Path(self._stacks.name), error.pid)
        if words.no_memory and isinstance(job, RunStage) and self._setup.recipe.can_reject:
            return StageRejected(too_large(job, self._setup.memory_gb), StageCost(0.0, 0.0, 0.0))
        how = _exit_description(error.exitcode)
        said = f": {words.said}" if words.said else ""
        at = f"; it was at {words.calls}" if words.calls else ""
        limit = self._setup.memory_gb
        memory = f"; its limit is run.memory_gb = {limit:g} GB" if limit and words.no_memory else ""
        if error.exitcode == -signal.SIGKILL:
            memory = "; it was killed from outside, probably by the system because memory ran out; lower --jobs or run.memory_gb"
        return Failure("died", f"the worker process died ({how}{said}){memory}{at}")


def _exit_description(exit_code: int | None) -> str:
    if exit_code is not None and exit_code < 0:
        return signal.Signals(-exit_code).name
    return f"exit code {exit_code}"
