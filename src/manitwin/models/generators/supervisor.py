"""Run a program and end it, with all that it started, when whoever asked for it is gone.

A script of its own, of the standard library only: ``python supervisor.py PROGRAM ARGUMENT...``. Its standard input is a pipe
that the asking process holds open; the pipe ends when that process closes it, or dies of whatever cause.
"""

from __future__ import annotations

import contextlib
import os
import resource
import select
import signal
import subprocess
import sys

LOOK_EVERY_S = 0.05
GRACE_S = 5.0
NOT_STARTED = 127  # what a shell says of a program that it cannot start


def supervise(arguments: list[str]) -> int:
    """Run a program in a process group of its own and return its exit status (-N: ended by signal N)."""
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    resource.setrlimit(
        resource.RLIMIT_DATA, (hard, hard)
    )  # run.memory_gb is of the process that asks, not of this program
    try:
        program = subprocess.Popen(arguments, stdin=subprocess.DEVNULL, start_new_session=True)
    except OSError as error:
        print(f"{arguments[0]}: {error.strerror or error}", file=sys.stderr)
        return NOT_STARTED
    while program.poll() is None:
        if select.select([sys.stdin], [], [], LOOK_EVERY_S)[0]:  # nobody writes into the pipe: readable is its end
            end(program)
    return program.returncode


def end(program: subprocess.Popen[bytes]) -> None:
    """End a program's process group: ask, wait 5 s, then kill."""
    for request in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(program.pid, request)
        with contextlib.suppress(subprocess.TimeoutExpired):
            program.wait(GRACE_S)
    # what the program left behind in its group is ended by the kill above, also where the program itself went at once


if __name__ == "__main__":
    status = supervise(sys.argv[1:])
    if status < 0:  # told on as a shell does: 128 and the signal's number
        status = 128 - status
    sys.exit(status)
