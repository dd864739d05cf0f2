"""Executor on a Ray cluster: machines may come, go and die; each job returns exactly once, with an answer or a Failure."""

from __future__ import annotations

import os
import shutil
import socket
import tempfile
import threading
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import ModuleType, TracebackType
from typing import Any

from manitwin.config import Resource, RunConfig
from manitwin.engine.executors.ray_pool import Actor, RayPool, Running
from manitwin.engine.executors.ray_worker import RayWorker
from manitwin.engine.jobs import Failure, Job, Reply, WorkerSetup
from manitwin.engine.machine_resources import available_cores
from manitwin.engine.stage import StagePart
from manitwin.errors import Unavailable, UsageError
from manitwin.formats.installation import installed_version
from manitwin.twin.dataset_root import DatasetRoot

ASK_EVERY_S = 1.0
SILENCE_S = 45.0
"""The head node counts as lost after this time. Ray kills the whole process after 60 s (gcs_rpc_server_reconnect_timeout_s)."""
CONNECT_S = 5.0
CURRENT_CLUSTER = "ray/ray_current_cluster"  # where `ray start` writes its address, below its temporary folder
OVERDUE_EVERY_S = 1.0
NODES_LOST = 3  # a job during which so many nodes died is considered the cause
THREADS: dict[Resource, int] = {"cpu": 1, "gpu": 1, "vlm": 8, "generator": 4}
"""Concurrent jobs per worker: several for jobs that wait for a service, one for jobs that compute."""
TAKES: dict[Resource, dict[str, float]] = {
    "cpu": {"num_cpus": 1},
    "gpu": {"num_cpus": 0, "num_gpus": 1},
    "vlm": {"num_cpus": 0},
    "generator": {"num_cpus": 0},
}
OBJECT_STORE_BYTES = 80 * 2**20  # about Ray's minimum: only ids, names and short texts are sent


class RayExecutor:
    """Executor on a Ray cluster: one worker per core, one per GPU, and few workers with many threads for jobs that wait for
    services.

    ``address`` is ``host:port``, or ``auto`` for the cluster of this machine; None starts a cluster here, which ``close``
    stops. If this process is already connected to a cluster, that connection is used and left open.

    If a worker dies, its job fails as "died". If the worker ran several jobs in threads, each is repeated alone in a worker,
    and only a job that kills such a worker fails. If a node dies, its jobs become "unavailable", which does not count as an
    attempt, unless it is the third node to die under the same job (a job that exhausts memory can take its machine down). Owns
    the connection, the workers and any cluster that it started.
    """

    def __init__(self, setup: WorkerSetup, settings: RunConfig, address: str | None = None):
        """Connect to the cluster. Raises UsageError if Ray is not installed, and Unavailable if no cluster answers."""
        self._ray = _import_ray()
        self._settings = settings
        self._temporary: Path | None = None
        self._connected = not self._ray.is_initialized()
        if self._connected:
            self._connect(address)
        self._make = self._ray.remote(max_restarts=0, max_task_retries=0)(RayWorker)
        root = DatasetRoot(setup.root_url)  # the working directory of a worker is not the driver's
        self._setup = self._ray.put(replace(setup, root_url=str(root.local or root.url)))
        self._version = installed_version()
        self._pools: dict[tuple[Resource, bool], RayPool] = {}
        self._nodes_lost: Counter[tuple[Any, ...]] = Counter()
        self._looked_at = 0.0
        self._head = HeadMonitor()

    def __enter__(self) -> RayExecutor:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def slots(self, needs: Resource) -> int:
        """Return how many jobs of a resource run concurrently, from the cores and GPUs of the nodes alive now.

        ``run.cpu``, if set, is returned even if fewer cores are alive, so that an autoscaler sees the demand.
        """
        if needs == "cpu":
            return self._settings.cpu or max(1, self._head.total("CPU"))
        if needs == "gpu":
            return max(1, self._head.total("GPU"))
        return self._settings.vlm if needs == "vlm" else self._settings.generator

    def submit(self, ticket: int, job: Job) -> None:
        """Submit a job to the pool of the resource it needs. Raises Unavailable if the cluster's head is lost."""
        self._head.check()
        pool = self._pool(job.needs, alone=False)
        pool.submit(ticket, job)
        pool.dispatch(self.slots(job.needs))

    def ended(self, timeout_s: float) -> list[tuple[int, Reply]]:
        """Wait for the next job that ends and return all ended jobs. Raises Unavailable if the cluster's head is lost."""
        until = time.monotonic() + timeout_s
        ended: list[tuple[int, Reply]] = []
        while True:
            self._head.check()
            left_s = 0.0 if ended else max(0.0, until - time.monotonic())
            for ref in self._ready(left_s):
                for pool in list(self._pools.values()):
                    ended += pool.process_ready_ref(ref)
            if time.monotonic() - self._looked_at > OVERDUE_EVERY_S:
                self._looked_at = time.monotonic()
                for pool in list(self._pools.values()):
                    ended += pool.end_overdue_jobs()
            for (needs, alone), pool in self._pools.items():
                pool.dispatch(1 if alone else self.slots(needs))
            if ended or time.monotonic() >= until:
                return ended

    def parts(self) -> dict[int, StagePart]:
        """Return an empty dict: progress within a stage is not sent across the cluster."""
        return {}

    def close(self) -> None:
        """Stop the workers and disconnect; stop the cluster if it was started here."""
        self._head.close()
        if self._head.seconds_since_answer < 5.0:  # a lost head cannot be told; the workers end with the connection
            for pool in self._pools.values():
                pool.close()
        self._pools.clear()
        if self._connected:
            self._ray.shutdown()
        if self._temporary is not None:
            shutil.rmtree(self._temporary, ignore_errors=True)

    def _connect(self, address: str | None) -> None:
        quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": "ERROR"}
        if address is not None:
            self._ray.init(address=check_head_address(address), **quiet)
        else:
            self._temporary = Path(tempfile.mkdtemp(prefix="mt-", dir="/tmp"))  # a socket path has at most 107 bytes
            self._ray.init(
                num_cpus=self._settings.cpu or available_cores(),
                include_dashboard=False,
                object_store_memory=OBJECT_STORE_BYTES,
                _temp_dir=str(self._temporary),
                **quiet,
            )
        # Ray prints pages about every dead worker to stdout regardless of its settings; the reason is in the Failure.
        self._ray._private.worker._worker_logs_enabled = False

    def _ready(self, timeout_s: float) -> list[Any]:
        refs = [ref for pool in self._pools.values() for ref in pool.refs]
        wait_s = min(timeout_s, OVERDUE_EVERY_S)
        if not refs:
            time.sleep(wait_s)
            return []
        first, others = self._ray.wait(refs, num_returns=1, timeout=wait_s)
        if not first or not others:
            return list(first)
        return [*first, *self._ray.wait(others, num_returns=len(others), timeout=0)[0]]

    def _pool(self, needs: Resource, alone: bool) -> RayPool:
        if (needs, alone) not in self._pools:
            threads = 1 if alone else THREADS[needs]
            options = TAKES[needs] | {"max_concurrency": threads, "scheduling_strategy": "SPREAD"}
            make = self._make.options(**options)
            self._pools[needs, alone] = RayPool(
                threads,
                lambda: make.remote(self._setup, self._version),
                self._head.has_lost,
                self._reply_after_death,
                self._settings.stage_timeout_s,
            )
        return self._pools[needs, alone]

    def _reply_after_death(self, running: Running, actor: Actor, together: int) -> Reply:
        """Return the reply for a job whose worker or node died; None if the job is submitted again to a worker of its own."""
        job, cause = running.job, actor.cause
        if actor.death == "unreachable":
            return Failure("unavailable", f"its worker stopped answering: {cause}")
        if actor.death == "node":
            what = (type(job), getattr(job, "number", None), getattr(job, "stage", None))
            self._nodes_lost[what] += 1
            if self._nodes_lost[what] < NODES_LOST:
                return Failure("unavailable", f"the node that worked on it died ({cause})")
            return Failure("died", f"{NODES_LOST} nodes died while they worked on it ({cause})")
        if together > 1:
            self._pool(job.needs, alone=True).submit(running.ticket, job)
            return None
        return Failure("died", f"the worker process died ({cause})")


def _import_ray() -> ModuleType:
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray
        import ray.util.scheduling_strategies
    except ImportError as error:
        raise UsageError("Ray is not installed; `pip install manitwin[ray]`, or run with --executor local") from error
    return ray


def check_head_address(address: str) -> str:
    """Return the ``host:port`` of a cluster's head after checking that it accepts connections: Ray retries a dead one for
    minutes.

    ``auto`` is the cluster of this machine. Raises Unavailable if nothing answers, and UsageError for an invalid address.
    """
    if address == "auto":
        noted = Path(os.environ.get("RAY_TMPDIR", "/tmp")) / CURRENT_CLUSTER
        address = os.environ.get("RAY_ADDRESS") or (noted.read_text().strip() if noted.is_file() else "")
        if not address:
            raise Unavailable(
                "no Ray cluster runs on this machine; start one with `ray start --head`, or give its address"
            )
    host, _, port = address.rpartition(":")
    if "://" in address or not host or not port.isdigit():
        raise UsageError(f"{address}: not the address of a Ray cluster; give host:port, or auto on one of its nodes")
    try:
        socket.create_connection((host, int(port)), timeout=CONNECT_S).close()
    except OSError as error:
        raise Unavailable(
            f"no Ray cluster answers at {address} ({error}); check that its head node is running"
        ) from error
    return address


class HeadMonitor:
    """The latest node list reported by the cluster's head.

    Owns a thread that polls the head. A call to a lost head never returns, so that only this thread calls it.
    """

    def __init__(self) -> None:
        self._totals: dict[str, float] = {}
        self._dead: frozenset[str] = frozenset()
        self._error = "it does not answer"
        self._poll()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._poll_until_stopped, name="manitwin-ray-head", daemon=True)
        self._thread.start()

    @property
    def seconds_since_answer(self) -> float:
        """Seconds since the head last answered."""
        return time.monotonic() - self._heard_at

    def check(self) -> None:
        """Raise Unavailable if the head is lost."""
        if self.seconds_since_answer > SILENCE_S:
            raise Unavailable(
                f"the head of the Ray cluster is lost ({self._error} since {self.seconds_since_answer:.0f} s); "
                "restart the cluster, then rerun the same command to resume"
            )

    def total(self, resource: str) -> int:
        """Return the total amount of a resource on all live nodes."""
        return int(self._totals.get(resource, 0))

    def has_lost(self, node: str) -> bool:
        """Tell whether a node has died."""
        return node in self._dead

    def close(self) -> None:
        """Stop polling."""
        self._stop.set()
        self._thread.join(2 * ASK_EVERY_S)  # a thread that hangs in a call to a lost head ends with the process

    def _poll_until_stopped(self) -> None:
        while not self._stop.wait(ASK_EVERY_S):
            try:
                self._poll()
            except Exception as error:  # any error counts as no answer; ``check`` raises once it has lasted
                self._error = " ".join(f"{type(error).__name__}: {error}".split())

    def _poll(self) -> None:
        import ray

        nodes = ray.nodes()
        totals: dict[str, float] = {}
        for node in nodes:
            for name, amount in node["Resources"].items() if node["Alive"] else ():
                totals[name] = totals.get(name, 0.0) + amount
        self._totals = totals
        self._dead = frozenset(node["NodeID"] for node in nodes if not node["Alive"])
        self._heard_at = time.monotonic()
