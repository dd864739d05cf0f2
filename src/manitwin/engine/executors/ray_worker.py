"""The worker process on a node of a Ray cluster, and diagnosis of a worker that died."""

from __future__ import annotations

import faulthandler
import os
import queue
import tempfile
import time
from pathlib import Path

from manitwin.engine.jobs import Job, Reply, WorkerSetup
from manitwin.engine.process_limits import limit_library_threads, limit_memory
from manitwin.engine.worker import Worker
from manitwin.engine.worker_processes import freeze_garbage_collector, map_large_blocks, return_free_memory
from manitwin.errors import UsageError
from manitwin.formats.installation import installed_version

STACK_LINES = 12
STALE_S = 3600.0  # older stack files belong to workers of runs that are over


class RayWorker:
    """Ray actor that runs jobs in its own process, in several threads if the jobs mostly wait.

    Owns a file on its node to which faulthandler writes the stack when native code crashes.
    """

    def __init__(self, setup: WorkerSetup, wanted_version: str):
        """Initialize the process. Raises UsageError if this node has another version of manitwin than the driver."""
        here = installed_version()
        if here != wanted_version:
            raise UsageError(
                f"this node has manitwin {here}, but the driver has {wanted_version}; install the same"
                f" version on all nodes"
            )
        limit_library_threads()
        limit_memory(setup.memory_gb)
        map_large_blocks()
        freeze_garbage_collector()
        self._setup = setup
        self._idle: queue.SimpleQueue[Worker] = queue.SimpleQueue()
        self._stack = _stack_folder() / f"{os.getpid()}.txt"
        self._stack_file = self._stack.open("w")
        faulthandler.enable(self._stack_file, all_threads=False)

    def where(self) -> tuple[str, str]:
        """Return the node's id and the path of the stack file on it."""
        import ray

        return ray.get_runtime_context().get_node_id(), str(self._stack)

    def do(self, job: Job) -> Reply:
        """Run a job and return its reply. Each thread has its own Worker, because stages need not be thread-safe."""
        try:
            worker = self._idle.get_nowait()
        except queue.Empty:
            worker = Worker(self._setup)
        try:
            return worker.do(job)
        finally:
            self._idle.put(worker)
            return_free_memory()


def read_crash_report(path: str) -> str:
    """Return the signal and innermost calls that a dead worker on this node left; empty if it was killed without writing
    anything.
    """
    stack = Path(path)
    lines = stack.read_text(errors="replace").splitlines() if stack.is_file() else []
    stack.unlink(missing_ok=True)
    calls = [line.strip() for line in lines if line.startswith("  File")][:STACK_LINES]
    signal = [line.removeprefix("Fatal Python error: ") for line in lines if line.startswith("Fatal Python error")][:1]
    return "".join(signal) + ("; it was at " + " < ".join(calls) if calls else "")


def _stack_folder() -> Path:
    """Return the node's folder of stack files; remove stale files of earlier runs."""
    folder = Path(tempfile.gettempdir()) / f"manitwin-stacks-{os.getuid()}"
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*.txt"):
        if not Path(f"/proc/{old.stem}").exists() and time.time() - old.stat().st_mtime > STALE_S:
            old.unlink(missing_ok=True)
    return folder
