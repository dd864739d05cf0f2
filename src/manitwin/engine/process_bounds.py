"""What bounds a process that works for another: its driver's life, one thread, so much memory."""

from __future__ import annotations

import ctypes
import os
import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager

PR_SET_PDEATHSIG = 1  # prctl(2)
ONE_THREAD = {"OMP_NUM_THREADS": "1", "LP_NUM_THREADS": "0"}


def die_with(driver: int) -> None:
    """Have this process killed when the driver is: an orphan would work on beside the next run."""
    try:
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    except (OSError, AttributeError):  # not Linux: an orphan ends after its job, whose result is found by its key
        return
    if os.getppid() != driver:
        os._exit(1)


def one_thread_each() -> None:
    """Keep libraries that are loaded later from starting threads of their own, where the environment does not say.

    OpenMP's and linear algebra's, and those of Mesa's lavapipe, which 0 makes draw in the thread that asks: two workers on two
    cores then spend a sixth less on a picture.
    """
    for name, threads in ONE_THREAD.items():
        os.environ.setdefault(name, threads)


@contextmanager
def one_thread_in_new_processes() -> Iterator[None]:
    """Keep processes that are started in the ``with`` statement to one thread each, and leave this one as it is.

    A spawned process has loaded NumPy before anything of ours runs in it, and NumPy's linear algebra starts its threads as it is
    loaded: on two cores they waited for each other during a sixth of a twin's CPU time.
    """
    added = [name for name in ONE_THREAD if name not in os.environ]
    one_thread_each()
    try:
        yield
    finally:
        for name in added:
            os.environ.pop(name, None)


def limit_memory(gigabytes: float) -> None:
    """Bound the heap, the arrays and the stacks of this process (2^30 bytes each; 0: no limit): more is a MemoryError.

    RLIMIT_DATA, which counts private writable memory (Linux 4.7 and later): RLIMIT_AS would also count the addresses that
    libraries and drivers reserve and never fill, hundreds of gigabytes with CUDA. The hard limit stays, for programs of the
    user that a stage starts.
    """
    if gigabytes:
        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        wanted = int(gigabytes * (1 << 30))
        resource.setrlimit(
            resource.RLIMIT_DATA, (wanted if hard == resource.RLIM_INFINITY else min(wanted, hard), hard)
        )
