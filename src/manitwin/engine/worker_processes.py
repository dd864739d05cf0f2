"""Worker processes: forked or spawned, shielded from Ctrl-C, with memory returned to the system."""

from __future__ import annotations

import ctypes
import gc
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.context import SpawnContext, SpawnProcess
from multiprocessing.synchronize import RLock
from typing import Any

from manitwin.engine.fork_server import start_forked
from manitwin.engine.process_limits import limit_child_threads

LARGE_BYTES = 2 << 20  # blocks from this size on are mapped individually
M_MMAP_THRESHOLD = -3  # mallopt(3)
KEPT_BYTES = 16 << 20  # free memory that stays mapped for the next stage


@contextmanager
def shield_from_interrupts() -> Iterator[None]:
    """Shield processes that are spawned by threads started within the ``with`` statement from Ctrl-C.

    A terminal sends SIGINT to all of them, and a process that is still importing would print a traceback. A thread inherits the
    signal mask of its creator, and a process that of its thread (pthread_sigmask(3)). The resource tracker is started before,
    because starting it unblocks the signal in the calling thread (bugs.python.org/issue33613).
    """
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    try:
        # raises what a pending handler raises, with the mask set
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _AllocatorState(ctypes.Structure):
    """``struct mallinfo2`` (mallinfo(3), glibc 2.33 and later); ``fordblks`` is the number of free bytes kept by the
    allocator.
    """

    _fields_ = tuple(
        (name, ctypes.c_size_t)
        for name in (
            "arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"
        )
    )  # fmt: skip


def freeze_garbage_collector() -> None:
    """Exempt all current objects from garbage collection, which then takes milliseconds for newer objects."""
    gc.freeze()


def map_large_blocks() -> None:
    """Make glibc return large memory blocks to the system when they are freed; without glibc this does nothing.

    By default glibc raises its mmap threshold to the largest block freed so far, up to 32 MB (mallopt(3)): freed arrays and
    textures then leave holes between live blocks, on top of which a stage with a large demand allocates.
    """
    library = ctypes.CDLL(None)
    if hasattr(library, "mallopt"):
        library.mallopt(M_MMAP_THRESHOLD, LARGE_BYTES)


def return_free_memory() -> None:
    """Return free memory of this process to the system between jobs, whose demands differ.

    First, meshes and their caches, which contain reference cycles, are garbage-collected (about a hundred megabytes). glibc
    keeps free memory below any live block, several hundred megabytes in the worker of a long run. Up to ``KEPT_BYTES`` are kept
    for the next job. Without glibc, nothing is returned.
    """
    gc.collect()
    library = ctypes.CDLL(None)
    if not hasattr(library, "mallinfo2"):
        return
    library.mallinfo2.restype = _AllocatorState
    if library.mallinfo2().fordblks > KEPT_BYTES:
        library.malloc_trim(ctypes.c_size_t(0))


class _WorkerProcess(SpawnProcess):
    """A process whose libraries use one thread."""

    @staticmethod
    def _Popen(process_obj: Any) -> Any:  # the name that multiprocessing's start() calls
        forked = start_forked(process_obj)
        if forked is not None:
            return forked
        with limit_child_threads():
            return SpawnProcess._Popen(process_obj)


class WorkerContext(SpawnContext):
    """Multiprocessing context of one pool: workers are forked if a fork server runs, else spawned; locks live as long as the
    context.

    Pebble drops its locks before it stops its last workers (``WorkerChannel.close``). A worker that is just starting would not
    find them, and print a traceback.
    """

    def __init__(self) -> None:
        super().__init__()
        self._kept: list[RLock] = []
        self._started: list[SpawnProcess] = []

    def Process(self, *args: Any, **kwargs: Any) -> SpawnProcess:  # type: ignore[override]
        """Return a new process, which ``kill`` will end."""
        process = _WorkerProcess(*args, **kwargs)
        self._started = [*(each for each in self._started if each.is_alive()), process]
        return process

    def kill(self) -> None:
        """Kill all processes started from this context, including stopped ones (SIGSTOP) and those in native code."""
        for process in self._started:
            if process.is_alive():
                process.kill()

    def RLock(self) -> RLock:
        """Return a lock that this context keeps alive."""
        lock = super().RLock()
        self._kept.append(lock)
        return lock


@contextmanager
def hidden_main_module() -> Iterator[None]:
    """Prevent spawned workers from importing the main script, which without a main guard would start workers again."""
    main = sys.modules["__main__"].__dict__
    hidden: dict[str, Any] = {name: main[name] for name in ("__file__", "__spec__") if name in main}
    main.pop("__file__", None)
    main["__spec__"] = None
    try:
        yield
    finally:
        main.update(hidden)
