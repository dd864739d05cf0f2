"""What worker processes do about their memory and their threads."""

from __future__ import annotations

import os
import subprocess
import sys
from multiprocessing.connection import Connection

import numpy as np
import pytest

from manitwin.engine.process_limits import ONE_THREAD
from manitwin.engine.worker_processes import WorkerContext

FREED = """
from manitwin.engine.worker_processes import return_free_memory

def resident_mb():
    with open("/proc/self/statm") as stream:
        return int(stream.read().split()[1]) * 4096 / 1e6

blocks = [bytes(50_000) for _ in range(6_000)]  # each below what the allocator maps by itself
blocks = blocks[-1:]  # above all that is free now, which therefore stays
before = resident_mb()
return_free_memory()
print(before - resident_mb())
"""
KEPT = FREED.replace("6_000", "200")
LARGE = """
from manitwin.engine.worker_processes import map_large_blocks

def resident_mb():
    with open("/proc/self/statm") as stream:
        return int(stream.read().split()[1]) * 4096 / 1e6

map_large_blocks()
b"x" * (16 << 20)  # freed at once, which would raise the allocator's own limit
blocks = [b"x" * (4 << 20) for _ in range(50)]
blocks, before = blocks[-1:], resident_mb()
print(before - resident_mb())
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
@pytest.mark.parametrize(
    ("program", "least_mb", "most_mb"),
    [(FREED, 250, 310), (KEPT, -1, 1), (LARGE, 195, 215), (LARGE.replace("map_large_blocks()\n", "\n"), -1, 1)],
    ids=["much", "little", "large", "by itself"],
)
def test_freed_memory_is_given_back_where_it_is_much(program: str, least_mb: float, most_mb: float) -> None:
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert least_mb < float(done.stdout) < most_mb


def tell_threads(answer: Connection) -> None:
    """Answer with the number of threads that are there once matrices were multiplied."""
    matrix = np.ones((600, 600))
    answer.send(float((matrix @ matrix)[0, 0]) / 600 * len(os.listdir("/proc/self/task")))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_linear_algebra_of_a_worker_has_one_thread_though_it_was_loaded_before_the_worker_began(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ONE_THREAD:
        monkeypatch.delenv(name, raising=False)
    context = WorkerContext()
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=tell_threads, args=(sender,))
    process.start()
    assert receiver.recv() == 1
    process.join()
    assert not set(ONE_THREAD) & set(os.environ), "this process stays as it was"
