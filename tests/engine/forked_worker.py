"""What a worker process says of itself, for test_fork_server.py: the programs that start one are not the tests' own process."""

from __future__ import annotations

import logging
import os
import signal
import sys
from multiprocessing.connection import Connection
from typing import Any

from manitwin.engine.fork_server import parent_of_workers
from manitwin.engine.process_limits import set_parent_death_signal
from manitwin.engine.worker_processes import WorkerContext, hidden_main_module

MODULE = "this"  # of Python's own, which nothing imports; it prints a poem


def tell(answer: Connection, driver: int) -> None:
    """Say what this process has of the one that it works for, and wait for an answer."""
    set_parent_death_signal(parent_of_workers(driver))
    answer.send(
        {
            "pid": os.getpid(),
            "parent": os.getppid(),
            "imported": MODULE in sys.modules,
            "blocked": signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []),
            "terminates": signal.getsignal(signal.SIGTERM) == signal.SIG_DFL,
            "handlers": len(logging.getLogger().handlers),
            "threads": os.environ.get("OMP_NUM_THREADS"),
        }
    )
    answer.recv()


def started() -> tuple[dict[str, Any], Any, Connection]:
    """Start a worker; returns what it says, its process, and the connection on which it waits."""
    context = WorkerContext()
    here, there = context.Pipe()
    with hidden_main_module():
        process = context.Process(target=tell, args=(there, os.getpid()))
        process.start()
    there.close()
    return here.recv(), process, here
