"""Worker processes: forked, or spawned without the script that started them, and spared from interrupts."""

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
from manitwin.engine.process_bounds import one_thread_in_new_processes

LARGE_BYTES = 2 << 20  # blocks from this size on are mapped each by itself
M_MMAP_THRESHOLD = -3  # mallopt(3)
KEPT_BYTES = 16 << 20  # free memory that stays mapped for the next stage


@contextmanager
def spared_from_interrupts() -> Iterator[None]:
    """Keep Ctrl-C from the processes that threads started in here will spawn.

    A terminal sends it to all of them, and one that is still importing would answer with a traceback. A thread inherits
    the mask of the one that starts it, and a process that of its thread (pthread_sigmask(3)). The resource tracker is
    started before: starting it lifts the mask of the thread that does (bugs.python.org/issue33613).
    """
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    try:
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # raises what a handler does, the mask set
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _AllocatorState(ctypes.Structure):
    """``struct mallinfo2`` (mallinfo(3), glibc 2.33 and later); ``fordblks`` are the bytes that are free and kept."""

    _fields_ = tuple(
        (name, ctypes.c_size_t)
        for name in (
            "arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"
        )
    )  # fmt: skip


def keep_imported() -> None:
    """Exempt all objects that exist now from garbage collection, which then looks through later ones only, in milliseconds."""
    gc.freeze()


def map_large_blocks() -> None:
    """Have large blocks of memory go back to the system as they are freed; elsewhere than with glibc nothing is done.

    By itself glibc raises its limit for that to the largest block that was freed, up to 32 MB (mallopt(3)): arrays and textures
    then leave holes between what stays, which a stage that needs much comes on top of.
    """
    library = ctypes.CDLL(None)
    if hasattr(library, "mallopt"):
        library.mallopt(M_MMAP_THRESHOLD, LARGE_BYTES)


def return_free_memory() -> None:
    """Give the memory back that this process has freed and its allocator keeps, between jobs of which each has other needs.

    Meshes and their caches, and what lies in cycles with them, a hundred megabytes, are collected first. glibc keeps what
    lies below anything still in use, for a worker of a long run several hundred megabytes. Less than ``KEPT_BYTES`` stay, for
    the next job. Elsewhere than with glibc none is given back.
    """
    gc.collect()
    library = ctypes.CDLL(None)
    if not hasattr(library, "mallinfo2"):
        return
    library.mallinfo2.restype = _AllocatorState
    if library.mallinfo2().fordblks > KEPT_BYTES:
        library.malloc_trim(ctypes.c_size_t(0))


class _WorkerProcess(SpawnProcess):
    """A process whose libraries keep to one thread."""

    @staticmethod
    def _Popen(process_obj: Any) -> Any:  # multiprocessing's own name, called by start()
        forked = start_forked(process_obj)
        if forked is not None:
            return forked
        with one_thread_in_new_processes():
            return SpawnProcess._Popen(process_obj)


class WorkerContext(SpawnContext):
    """Start the workers of one pool, whose locks last as long as this context: forked where a server does that, else spawned.

    pebble takes its locks away before it ends its last workers (``WorkerChannel.close``): one that is starting at that
    moment does not find them, and says so with a traceback.
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
        """End all processes that were started here, also those that are stopped (SIGSTOP) or in native code."""
        for process in self._started:
            if process.is_alive():
                process.kill()

    def RLock(self) -> RLock:
        """Return a lock that is there until this context is gone."""
        lock = super().RLock()
        self._kept.append(lock)
        return lock


@contextmanager
def hidden_main_module() -> Iterator[None]:
    """Keep spawned workers from importing the script that started them: without a guard it would start them again."""
    main = sys.modules["__main__"].__dict__
    hidden: dict[str, Any] = {name: main[name] for name in ("__file__", "__spec__") if name in main}
    main.pop("__file__", None)
    main["__spec__"] = None
    try:
        yield
    finally:
        main.update(hidden)
