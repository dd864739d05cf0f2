"""What a machine has for a run: the cores that it is bound to, its memory, and a container's share of both."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from manitwin.engine.machine_resources import WORKER_BYTES, available_cores, available_memory_bytes, available_workers


@pytest.fixture(autouse=True)
def of_64_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: set(range(64)), raising=False)


def system(folder: Path, groups: str, **limits: str) -> Path:
    """A machine's files: what control groups its process is in, and the limits by their place, ``/`` written as ``__``."""
    (folder / "proc/self").mkdir(parents=True)
    (folder / "proc/self/cgroup").write_text(groups)
    for place, content in limits.items():
        path = folder / "sys/fs/cgroup" / place.replace("__", "/").replace("CPU", "cpu,cpuacct").replace("_DOT_", ".")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
    return folder


@pytest.mark.parametrize(
    ("quota", "cores"),
    [
        ("200000 100000", 2),
        ("150000 100000", 2),
        ("50000 100000", 1),
        ("max 100000", 64),
        ("9900000 100000", 64),
        ("", 64),
    ],
)
def test_quota_of_a_container_bounds_the_cores(tmp_path: Path, quota: str, cores: int) -> None:
    assert available_cores(system(tmp_path, "0::/\n", cpu_DOT_max=quota + "\n")) == cores


def test_group_around_a_group_bounds_it_too(tmp_path: Path) -> None:
    made = system(tmp_path, "0::/pod/task\n", pod__cpu_DOT_max="300000 100000", pod__task__cpu_DOT_max="max 100000")
    assert available_cores(made) == 3


def test_quota_of_the_first_version_of_control_groups(tmp_path: Path) -> None:
    made = system(
        tmp_path,
        "5:memory:/docker/a\n4:cpu,cpuacct:/docker/a\n0::/system.slice\n",
        CPU__docker__a__cpu_DOT_cfs_quota_us="400000",
        CPU__docker__a__cpu_DOT_cfs_period_us="100000",
        CPU__cpu_DOT_cfs_quota_us="-1",
        CPU__cpu_DOT_cfs_period_us="100000",
    )
    assert available_cores(made) == 4


def test_machine_without_control_groups_has_all_its_cores(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert available_cores(tmp_path) == 64
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 10)
    assert available_cores(tmp_path) == 10
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert available_cores(tmp_path) == 1


def test_cores_that_a_process_is_bound_to_are_no_more_than_those(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {5}, raising=False)
    assert available_cores(system(tmp_path, "0::/\n", cpu_DOT_max="400000 100000")) == 1


def test_memory_that_is_free_bounds_the_workers_and_it_is_told(tmp_path: Path) -> None:
    made, told = system(tmp_path, "0::/\n"), list[str]()
    (made / "proc/meminfo").write_text(f"MemTotal: 99999999 kB\nMemAvailable: {5 * WORKER_BYTES // 1024 + 1} kB\n")
    assert available_workers(5, made, tell=told.append) == 5 and not told, (
        "nothing is told where there is no more to do"
    )
    assert available_workers(system=made, tell=told.append) == 5
    assert told == [
        "5 of 64 cores were used: 3.8 GB of memory were free, and a worker takes up to 0.75; run.cpu (--jobs) sets their number"
    ]
    (made / "proc/meminfo").write_text("MemAvailable: 10 kB\n")
    assert available_workers(system=made) == 1


def test_memory_of_a_container_counts_what_its_cache_can_let_go(tmp_path: Path) -> None:
    made = system(
        tmp_path,
        "0::/\n",
        memory_DOT_max=str(8 * 2**30),
        memory_DOT_current=str(6 * 2**30),
        memory_DOT_stat=f"anon 5\ninactive_file {2**30}\n",
    )
    (made / "proc/meminfo").write_text("MemAvailable: 99999999 kB\n")
    assert available_memory_bytes(made) == 3 * 2**30
    assert available_workers(system=made) == 4
    (made / "sys/fs/cgroup/memory.max").write_text("max\n")
    assert available_memory_bytes(made) == 99999999 * 1024


def test_machine_that_does_not_say_its_memory_has_a_worker_a_core(tmp_path: Path) -> None:
    assert available_memory_bytes(tmp_path) is None
    assert available_workers(system=tmp_path) == 64
