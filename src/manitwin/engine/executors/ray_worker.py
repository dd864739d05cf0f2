"""The worker process on a cluster's nodes, which does jobs, and the reading of one that died."""

from __future__ import annotations

import faulthandler
import os
import queue
import tempfile
import time
from pathlib import Path

from manitwin.engine.jobs import Job, Reply, WorkerSetup
from manitwin.engine.process_bounds import limit_memory, one_thread_each
from manitwin.engine.worker import Worker
from manitwin.engine.worker_processes import keep_imported, map_large_blocks, return_free_memory
from manitwin.errors import UsageError
from manitwin.formats.installation import installed_version

STACK_LINES = 12
STALE_S = 3600.0  # a stack that nobody asked for by then is of a worker whose run is over


class RayWorker:
    """Does jobs in a process of its own, in several threads where those mostly wait.

    Owns: a file on its node, into which the interpreter writes where it was when native code crashed.
    """

    def __init__(self, setup: WorkerSetup, wanted_version: str):
        """Raises UsageError where the node has another manitwin than the driver: its results would be others."""
        here = installed_version()
        if here != wanted_version:
            raise UsageError(
                f"this node has manitwin {here}, but the driver has {wanted_version}; install the same"
                f" version on all nodes"
            )
        one_thread_each()
        limit_memory(setup.memory_gb)
        map_large_blocks()
        keep_imported()
        self._setup = setup
        self._idle: queue.SimpleQueue[Worker] = queue.SimpleQueue()
        self._stack = _stack_folder() / f"{os.getpid()}.txt"
        self._stack_file = self._stack.open("w")
        faulthandler.enable(self._stack_file, all_threads=False)

    def where(self) -> tuple[str, str]:
        """Return the node's id, and the path there of the file with the stack."""
        import ray

        return ray.get_runtime_context().get_node_id(), str(self._stack)

    def do(self, job: Job) -> Reply:
        """Return the job's answer. A Worker serves one thread at a time: stages need not be safe for several."""
        try:
            worker = self._idle.get_nowait()
        except queue.Empty:
            worker = Worker(self._setup)
        try:
            return worker.do(job)
        finally:
            self._idle.put(worker)
            return_free_memory()


def last_words(path: str) -> str:
    """Return what a dead worker of this node left: the signal and its innermost calls; empty where it was just killed."""
    stack = Path(path)
    lines = stack.read_text(errors="replace").splitlines() if stack.is_file() else []
    stack.unlink(missing_ok=True)
    calls = [line.strip() for line in lines if line.startswith("  File")][:STACK_LINES]
    signal = [line.removeprefix("Fatal Python error: ") for line in lines if line.startswith("Fatal Python error")][:1]
    return "".join(signal) + ("; it was at " + " < ".join(calls) if calls else "")


def _stack_folder() -> Path:
    """Return the node's folder of stacks, swept of those of earlier runs."""
    folder = Path(tempfile.gettempdir()) / f"manitwin-stacks-{os.getuid()}"
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*.txt"):
        if not Path(f"/proc/{old.stem}").exists() and time.time() - old.stat().st_mtime > STALE_S:
            old.unlink(missing_ok=True)
    return folder
