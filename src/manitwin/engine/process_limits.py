"""Limits of worker processes: parent-death signal, one thread, bounded memory."""

from __future__ import annotations

import ctypes
import os
import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager

PR_SET_PDEATHSIG = 1  # prctl(2)
ONE_THREAD = {"OMP_NUM_THREADS": "1", "LP_NUM_THREADS": "0"}


def set_parent_death_signal(driver: int) -> None:
    """Have the kernel kill this process when its parent ``driver`` dies: an orphan would interfere with the next run."""
    try:
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    except (OSError, AttributeError):  # not Linux: an orphan ends after its job, whose result is found by its key
        return
    if os.getppid() != driver:
        os._exit(1)


def limit_library_threads() -> None:
    """Limit libraries that are loaded later to one thread, unless the environment says otherwise.

    This covers OpenMP, linear algebra, and Mesa's lavapipe, which with 0 renders in the calling thread: two workers on two
    cores then need a sixth less time per image.
    """
    for name, threads in ONE_THREAD.items():
        os.environ.setdefault(name, threads)


@contextmanager
def limit_child_threads() -> Iterator[None]:
    """Limit processes that are started within the ``with`` statement to one thread each; this process is unchanged.

    A spawned process has loaded NumPy before any of our code runs, and NumPy's linear algebra library starts its threads on
    loading. On two cores these threads waited for each other during a sixth of a twin's CPU time.
    """
    added = [name for name in ONE_THREAD if name not in os.environ]
    limit_library_threads()
    try:
        yield
    finally:
        for name in added:
            os.environ.pop(name, None)


def limit_memory(gigabytes: float) -> None:
    """Limit heap, arrays and stacks of this process to ``gigabytes`` * 2^30 bytes (0: no limit); beyond that, MemoryError is
    raised.

    RLIMIT_DATA counts private writable memory (Linux 4.7 and later). RLIMIT_AS would also count address space that libraries
    and drivers reserve and never use, hundreds of gigabytes with CUDA. The hard limit is unchanged, for programs that a stage
    starts.
    """
    if gigabytes:
        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        wanted = int(gigabytes * (1 << 30))
        resource.setrlimit(
            resource.RLIMIT_DATA, (wanted if hard == resource.RLIM_INFINITY else min(wanted, hard), hard)
        )
