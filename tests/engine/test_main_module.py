"""Spawned workers: a pool that ends while one of them starts."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

STARTING = '''
"""What a worker reads first of all: it goes on once it is told to end, after the pool took its locks away."""
import os, signal


def wait_for_the_end(folder):
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
    open(os.path.join(folder, "starting"), "w").close()
    signal.sigwait({signal.SIGTERM})
    return folder


class Waits:
    def __init__(self, folder):
        self.folder = folder

    def __reduce__(self):
        return wait_for_the_end, (self.folder,)


def nothing(*given):
    pass
'''
PROGRAM = """
import os, sys, time
from pebble import ProcessPool
import starting
from manitwin.engine.worker_processes import WorkerContext, hidden_main_module

folder = sys.argv[1]
with hidden_main_module():
    pool = ProcessPool(max_workers=1, context=WorkerContext(), initializer=starting.nothing, initargs=(starting.Waits(folder),))
    pool.schedule(starting.nothing)
    while not os.path.exists(os.path.join(folder, "starting")):
        time.sleep(0.01)
    pool.stop()
    pool.join()
"""


def test_pool_that_ends_while_a_worker_starts_says_nothing(tmp_path: Path) -> None:
    (tmp_path / "starting.py").write_text(STARTING)
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, tmp_path],
        env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
