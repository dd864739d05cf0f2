"""Do jobs on this machine: a pool of processes for each resource, in which a crash or a hang costs one job."""

from __future__ import annotations

import faulthandler
import json
import logging
import os
import queue
import signal
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import CancelledError, TimeoutError
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

from pebble import ProcessExpired, ProcessPool

from manitwin.config import Resource, RunConfig
from manitwin.engine.jobs import Failure, Job, Reply, RunStage, WorkerSetup
from manitwin.engine.stage import StagePart, heard_by
from manitwin.engine.worker import Worker
from manitwin.engine.worker_processes import (
    WorkerContext,
    die_with,
    hidden_main_module,
    one_thread_each,
    spared_from_interrupts,
)

RUN = logging.getLogger("manitwin.run")
NOTE = ".part"
EVERY_S = 1.0

_failure_told = False
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


@contextmanager
def parts_noted(folder: Path, ticket: int) -> Iterator[None]:
    """Note in a folder what the stage that runs in the ``with`` statement says of itself, under the ticket of its job."""
    with heard_by(_Notes(folder / f"{ticket}{NOTE}")):
        try:
            yield
        finally:
            drop_note(folder, ticket)


def read_notes(folder: Path) -> dict[int, StagePart]:
    """Return what part of each job is done, by ticket; a job that has ended may still be among them."""
    found = {}
    for path in folder.glob(f"*{NOTE}"):
        with suppress(FileNotFoundError):  # its stage has ended meanwhile
            found[int(path.stem)] = StagePart(*json.loads(path.read_bytes()))
    return found


def drop_note(folder: Path, ticket: int) -> None:
    """Remove the note of a job that has ended."""
    (folder / f"{ticket}{NOTE}").unlink(missing_ok=True)


class _Notes:
    """Write down what a stage says of itself, once a second at most."""

    def __init__(self, path: Path):
        self._path, self._at = path, -EVERY_S

    def __call__(self, part: StagePart) -> None:
        if time.monotonic() - self._at < EVERY_S:
            return
        self._at = time.monotonic()
        fresh = self._path.with_suffix(".fresh")
        try:  # renamed, so that nobody reads a half, but not synced: it is of no use after a power cut
            fresh.write_text(json.dumps([part.done, part.total, part.unit]))
            os.replace(fresh, self._path)
        except OSError as error:
            _tell_once(error)


def _tell_once(error: OSError) -> None:
    """Log that a note was not written: the stage does its work all the same."""
    global _failure_told
    if not _failure_told:
        _failure_told = True
        RUN.warning("the progress of stages is not shown: %s", error)
