"""What worker processes do about their memory."""

from __future__ import annotations

import subprocess
import sys

import pytest

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
KEPT = FREED.replace("6_000", "600")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
@pytest.mark.parametrize(("program", "least_mb", "most_mb"), [(FREED, 250, 310), (KEPT, -1, 1)])
def test_freed_memory_is_given_back_where_it_is_much(program: str, least_mb: float, most_mb: float) -> None:
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert least_mb < float(done.stdout) < most_mb
