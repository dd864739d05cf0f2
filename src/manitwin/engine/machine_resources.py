"""CPU and memory limits of this process: affinity, control groups (containers) and free memory.

Source: Linux, Documentation/admin-guide/cgroup-v2.rst, ``cpu.max`` and ``memory.max``; for version 1 scheduler/sched-bwc.rst,
``cpu.cfs_quota_us``, and cgroup-v1/memory.rst, ``memory.limit_in_bytes``; proc_meminfo(5), ``MemAvailable``.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from pathlib import Path

WORKER_BYTES = 3 * 2**28
"""Peak memory of a worker with some margin: 0.6 GB was measured over 25 meshes and 28 photos."""

_SYSTEM = Path("/")


def available_workers(
    most: int | None = None, system: Path = _SYSTEM, *, tell: Callable[[str], None] = lambda line: None
) -> int:
    """Return how many workers this machine supports, at least 1: one per core, as far as memory allows.

    ``most`` bounds the number by the available work. ``tell`` is called with a message if memory limits it. ``system`` is the
    folder that contains ``proc`` and ``sys``.
    """
    cores, memory = available_cores(system), available_memory_bytes(system)
    cores = cores if most is None else max(1, min(cores, most))
    if memory is None or memory >= cores * WORKER_BYTES:
        return cores
    workers = max(1, memory // WORKER_BYTES)
    tell(
        f"{workers} of {cores} cores were used: {memory / 2**30:.1f} GB of memory were free, and a worker takes up to"
        f" {WORKER_BYTES / 2**30:.2f}; run.cpu (--jobs) sets their number"
    )
    return workers


def available_cores(system: Path = _SYSTEM) -> int:
    """Return how many cores this process may use, at least 1: its CPU affinity, bounded by the quota of its container.

    A container with 2 CPUs on a machine with 64 sees all 64, and is throttled once it has used its share. The smallest quota of
    its control group and the groups above it applies.
    """
    bound = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1  # macOS has none
    quotas = []
    for folder, version in _groups(system, "cpu"):
        if version == 2:
            words = _text_of(folder / "cpu.max").split()
        else:
            words = [_text_of(folder / f"cpu.cfs_{which}_us").strip() for which in ("quota", "period")]
        if len(words) == 2 and all(word.isdecimal() for word in words) and int(words[1]):  # not "max", not -1
            quotas.append(math.ceil(int(words[0]) / int(words[1])))
    return max(1, min([bound, *quotas]))


def available_memory_bytes(system: Path = _SYSTEM) -> int | None:
    """Return how many bytes can be allocated without swapping on the machine or in its container; None if unknown."""
    free = [1024 * number for name, number in _numbers(system / "proc/meminfo") if name == "MemAvailable:"]
    for folder, version in _groups(system, "memory"):
        limit, used, cache = (
            ("memory.max", "memory.current", "inactive_file")
            if version == 2
            else ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
        )
        numbers = [_text_of(folder / name).strip() for name in (limit, used)]
        if all(number.isdecimal() for number in numbers):
            let_go = sum(number for name, number in _numbers(folder / "memory.stat") if name == cache)
            free.append(max(0, int(numbers[0]) - int(numbers[1]) + let_go))
    return min(free, default=None)


def _groups(system: Path, controller: str) -> Iterator[tuple[Path, int]]:
    """Yield the folders of this process's control groups for a controller and of their ancestors, with the cgroup version.

    Ancestors include the root, because inside a container its own group may be mounted there.
    """
    for line in _text_of(system / "proc/self/cgroup").splitlines():
        _, controllers, group = [*line.split(":", 2), "", ""][:3]
        if controllers and controller not in controllers.split(","):
            continue
        parts = [part for part in group.split("/") if part not in ("", "..")]
        for count in range(len(parts), -1, -1):
            yield (system / "sys/fs/cgroup" / controllers).joinpath(*parts[:count]), 1 if controllers else 2


def _numbers(path: Path) -> Iterator[tuple[str, int]]:
    """Yield the name and number of each line that has both, ignoring units."""
    for line in _text_of(path).splitlines():
        words = line.split()
        if len(words) >= 2 and words[1].isdecimal():
            yield words[0], int(words[1])


def _text_of(path: Path) -> str:
    try:
        return path.read_text()
    except (OSError, ValueError):
        return ""
