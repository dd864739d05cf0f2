"""Run a program and end it, with all processes that it started, when the calling process is gone.

This is a standalone script that uses only the standard library: ``python supervisor.py PROGRAM ARGUMENT...``. Its standard
input is a pipe that the calling process holds open; the pipe ends when that process closes it or dies for any reason.
"""

from __future__ import annotations

import contextlib
import os
import resource
import select
import signal
import subprocess
import sys

POLL_INTERVAL_S = 0.05
GRACE_S = 5.0
NOT_STARTED = 127  # exit status of a shell for a program that it cannot start


def supervise(arguments: list[str]) -> int:
    """Run a program in its own process group and return its exit status (-N: ended by signal N)."""
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    resource.setrlimit(resource.RLIMIT_DATA, (hard, hard))  # run.memory_gb limits the calling process, not this program
    try:
        program = subprocess.Popen(arguments, stdin=subprocess.DEVNULL, start_new_session=True)
    except OSError as error:
        print(f"{arguments[0]}: {error.strerror or error}", file=sys.stderr)
        return NOT_STARTED
    while program.poll() is None:
        if select.select([sys.stdin], [], [], POLL_INTERVAL_S)[
            0
        ]:  # nothing is written into the pipe: readable means closed
            end_process_group(program)
    return program.returncode


def end_process_group(program: subprocess.Popen[bytes]) -> None:
    """End a program's process group: SIGTERM, wait 5 s, then SIGKILL."""
    for request in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(program.pid, request)
        with contextlib.suppress(subprocess.TimeoutExpired):
            program.wait(GRACE_S)
    # the SIGKILL also ends processes left in the group if the program itself ended at once


if __name__ == "__main__":
    status = supervise(sys.argv[1:])
    if status < 0:  # as a shell: 128 plus the signal's number
        status = 128 - status
    sys.exit(status)
