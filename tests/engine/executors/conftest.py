"""A Ray cluster of two machines on this one."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from rehearsal_recipe import RehearsalRecipe

NODE = {"num_cpus": 2, "object_store_memory": 80 * 2**20}
SOON = {"health_check_initial_delay_ms": 1000, "health_check_period_ms": 500, "health_check_failure_threshold": 3}


@dataclass
class Machines:
    """A head with two cores, and nodes beside it."""

    cluster: Any

    @property
    def address(self) -> str:
        """Where the head listens."""
        return str(self.cluster.address)

    def add(self) -> Any:
        """Start another node."""
        return self.cluster.add_node(**NODE)

    def kill(self, node: Any) -> None:
        """Kill a node as a machine dies: everything on it at once, and nobody is told."""
        self._send(node, signal.SIGKILL)

    def freeze(self, node: Any) -> None:
        """Stop a node as when its network is cut: connections stay open, and nothing comes over them."""
        self._send(node, signal.SIGSTOP)

    def _send(self, node: Any, what: signal.Signals) -> None:
        raylet = node.all_processes["raylet"][0].process.pid
        for pid in [raylet, *children(raylet)]:
            os.kill(pid, what)


def children(pid: int) -> list[int]:
    """The child processes of a process."""
    tasks = Path(f"/proc/{pid}/task").iterdir()
    return [int(child) for task in tasks for child in (task / "children").read_text().split()]


@pytest.fixture(scope="session")
def start_machines() -> Iterator[Callable[[], Machines]]:
    """Start a cluster's head; all of it ends with the tests."""
    pytest.importorskip("ray")
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    from ray.cluster_utils import Cluster

    started: list[Any] = []

    def start() -> Machines:
        head = {**NODE, "include_dashboard": False, "_system_config": SOON}
        started.append(Cluster(initialize_head=True, head_node_args=head))
        return Machines(started[-1])

    yield start
    for cluster in started:
        cluster.shutdown()


@pytest.fixture(scope="session")
def machines(start_machines: Callable[[], Machines]) -> Machines:
    """A head with two cores, to which a test adds nodes as it needs them."""
    return start_machines()


@pytest.fixture(scope="session")
def connected(machines: Machines) -> Iterator[str]:
    """This process is connected to the cluster; executors use that and leave it."""
    import ray

    ray.init(address=machines.address, log_to_driver=False, logging_level="ERROR")
    yield machines.address
    ray.shutdown()


@pytest.fixture
def recipe(tmp_path: Path) -> RehearsalRecipe:
    """Three stages, with a log of what ran."""
    return RehearsalRecipe(log=tmp_path / "log")
