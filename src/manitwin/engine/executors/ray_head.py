"""A cluster's head, asked once a second: what nodes there are, and whether it still answers."""

from __future__ import annotations

import os
import socket
import threading
import time
from pathlib import Path

from manitwin.errors import Unavailable, UsageError

ASK_EVERY_S = 1.0
SILENCE_S = 30.0
"""Then the head is taken for lost. Ray itself ends the whole process after 60 s (gcs_rpc_server_reconnect_timeout_s)."""
CONNECT_S = 5.0
CURRENT_CLUSTER = "ray/ray_current_cluster"  # where `ray start` notes its address, below its temporary folder


def reachable(address: str) -> str:
    """Return the ``host:port`` of a cluster's head, known to answer: Ray tries a dead one for minutes.

    ``auto`` is the cluster of this machine. Raises Unavailable where nobody answers, and UsageError for no such address.
    """
    if address == "auto":
        noted = Path(os.environ.get("RAY_TMPDIR", "/tmp")) / CURRENT_CLUSTER
        address = os.environ.get("RAY_ADDRESS") or (noted.read_text().strip() if noted.is_file() else "")
        if not address:
            raise Unavailable("no Ray cluster on this machine; start one with `ray start --head`, or give its address")
    host, _, port = address.rpartition(":")
    if "://" in address or not host or not port.isdigit():
        raise UsageError(f"{address}: not the address of a Ray cluster; give host:port, or auto on one of its nodes")
    try:
        socket.create_connection((host, int(port)), timeout=CONNECT_S).close()
    except OSError as error:
        raise Unavailable(f"no Ray cluster answers at {address} ({error}); is its head running?") from error
    return address


class Head:
    """What the head said last.

    Owns: a thread that asks it. A head that is lost never answers, and the call hangs: so nobody else asks.
    """

    def __init__(self) -> None:
        self._totals: dict[str, float] = {}
        self._dead: frozenset[str] = frozenset()
        self._error = "it does not answer"
        self._ask()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._keep_asking, name="manitwin-ray-head", daemon=True)
        self._thread.start()

    @property
    def silent_s(self) -> float:
        """For how long the head has not answered."""
        return time.monotonic() - self._heard_at

    def check(self) -> None:
        """Raise Unavailable where the head is lost."""
        if self.silent_s > SILENCE_S:
            raise Unavailable(
                f"the head of the Ray cluster is lost ({self._error} since {self.silent_s:.0f} s); "
                "start the cluster again, then the same command: the run goes on where it stopped"
            )

    def total(self, resource: str) -> int:
        """Return how much of a resource all nodes have that are alive."""
        return int(self._totals.get(resource, 0))

    def has_lost(self, node: str) -> bool:
        """Tell whether a node has died."""
        return node in self._dead

    def close(self) -> None:
        """Stop asking."""
        self._stop.set()
        self._thread.join(2 * ASK_EVERY_S)  # one that hangs in a call to a lost head ends with the process

    def _keep_asking(self) -> None:
        while not self._stop.wait(ASK_EVERY_S):
            try:
                self._ask()
            except Exception as error:  # whatever it is, it is no answer: ``check`` tells when it has lasted
                self._error = " ".join(f"{type(error).__name__}: {error}".split())

    def _ask(self) -> None:
        import ray

        nodes = ray.nodes()
        totals: dict[str, float] = {}
        for node in nodes:
            for name, amount in node["Resources"].items() if node["Alive"] else ():
                totals[name] = totals.get(name, 0.0) + amount
        self._totals = totals
        self._dead = frozenset(node["NodeID"] for node in nodes if not node["Alive"])
        self._heard_at = time.monotonic()
