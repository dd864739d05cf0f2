"""Entry points of local worker processes, and diagnosis of a worker that died."""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from manitwin.engine.executors.stage_progress import write_progress_notes
from manitwin.engine.fork_server import parent_of_workers
from manitwin.engine.jobs import Job, Reply, RunStage, WorkerSetup
from manitwin.engine.process_limits import limit_memory, set_parent_death_signal
from manitwin.engine.worker import Worker
from manitwin.engine.worker_processes import freeze_garbage_collector, map_large_blocks, return_free_memory
from manitwin.formats.printable import printable_line

STACK_LINES = 12
SAID_CHARACTERS = 200
READ_BYTES = 1 << 16
NO_MEMORY = ("bad_alloc", "out of memory", "cannot allocate memory", "memory allocation of")
"""Lower-case messages of C++, LLVM, glibc and Rust for a failed memory allocation."""

_worker: Worker | None = None
_stack_file: TextIO | None = None


def initialize_worker(setup: WorkerSetup, stacks: str, driver: int) -> None:
    """Initialize this worker process: link its life to the driver's, restore SIGTERM, capture stderr, and limit memory."""
    global _worker, _stack_file
    set_parent_death_signal(parent_of_workers(driver))
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # pebble's handler would wait for native code to return
    _stack_file = (Path(stacks) / f"{os.getpid()}.txt").open("a")
    faulthandler.enable(_stack_file)
    # Output of native code before it aborts goes to a file for the driver, and does not mix with the driver's own output.
    sys.stderr = os.fdopen(os.dup(2), "w", buffering=1, errors="backslashreplace")
    os.dup2(_stack_file.fileno(), 2)
    limit_memory(setup.memory_gb)
    _worker = Worker(setup)
    map_large_blocks()
    freeze_garbage_collector()


def run_job(ticket: int, job: Job) -> Reply:
    """Run a job and return its reply."""
    assert _worker is not None and _stack_file is not None
    os.ftruncate(_stack_file.fileno(), 0)  # discard output of earlier jobs
    if not isinstance(job, RunStage):
        return _worker.do(job)
    try:
        with write_progress_notes(Path(_stack_file.name).parent, ticket):
            return _worker.do(job)
    finally:
        return_free_memory()


@dataclass(frozen=True)
class CrashReport:
    """What a dead process left: the last line of native code, its innermost calls, and whether an allocation failed."""

    said: str = ""
    calls: str = ""
    no_memory: bool = False

    @classmethod
    def from_stack_file(cls, stacks: Path, pid: int | None) -> CrashReport:
        """Read the file that a process left in the stack folder; empty if the process was killed without writing anything."""
        path = stacks / f"{pid}.txt"
        if not path.is_file():
            return cls()
        with path.open("rb") as stream:
            lines = stream.read(READ_BYTES).decode("utf-8", errors="replace").splitlines()
        calls = [line.strip() for line in lines if line.startswith("  File")][:STACK_LINES]
        begin = next((i for i, line in enumerate(lines) if line.startswith("Fatal Python error")), len(lines))
        said = [line for line in lines[:begin] if line.strip()]
        no_memory = any(words in line.lower() for line in said for words in NO_MEMORY)
        last = printable_line(said[-1], max_characters=SAID_CHARACTERS) if said else ""
        return cls(last, " < ".join(calls), no_memory)
