"""Worker processes and the process that drives them: interrupts are the driver's, and no worker outlives it."""

from __future__ import annotations

import ctypes
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker

PR_SET_PDEATHSIG = 1  # prctl(2)


@contextmanager
def spared_from_interrupts() -> Iterator[None]:
    """Keep Ctrl-C from the processes that threads started in here will spawn.

    A terminal sends it to all of them, and one that is still importing would answer with a traceback. A thread inherits
    the mask of the one that starts it, and a process that of its thread (pthread_sigmask(3)). The resource tracker is
    started before: starting it lifts the mask of the thread that does (bugs.python.org/issue33613).
    """
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def die_with(driver: int) -> None:
    """Have this process killed when the driver is: an orphan would work on beside the next run."""
    try:
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    except (OSError, AttributeError):  # not Linux: an orphan ends after its job, whose result is found by its key
        return
    if os.getppid() != driver:
        os._exit(1)
