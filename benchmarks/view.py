"""Time the pages of the gallery over a synthetic index of 100,000 twins through the running server, and measure its memory.

    python benchmarks/view.py [--twins N] [--requests N] [--keep FOLDER]

``manitwin view`` serves the index in a separate process. Each kind of page is requested ``--requests`` times, with other words,
bounds and page numbers each time. The columns are milliseconds from request to the last byte, one request at a time, on the same
machine. Memory is the server's resident set at the start and at the end (VmRSS of Linux).
"""

from __future__ import annotations

import argparse
import http.client
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
from index import CATEGORIES, COLORS, write_index

from manitwin.twin.dataset_root import DatasetRoot

BAR_MS, BAR_MB = 300.0, 500.0


def pages(rng: np.random.Generator, twins: int) -> dict[str, str]:
    """Return an address for each kind of page."""
    category, color = str(rng.choice(CATEGORIES)).replace(" ", "+"), str(rng.choice(COLORS))
    return {
        "first page": "/",
        "a page in the middle": f"/?page={rng.integers(2, max(3, twins // 48))}",
        "category": f"/?category={category}",
        "two words": f"/?q={color}+{category.split('+')[0]}",
        "a word that few have": f"/?q={rng.integers(0, 16**6):06x}",
        "bounds and order": f"/?longest_min={rng.random():.2f}&mass_max={rng.random():.2f}&verified_min=30&sort=-verified",
        "order, last pages": f"/?sort=-robustness_median&page={twins // 48 - int(rng.integers(0, 9))}",
        "condition": f"/?where=success_rate+%3E+{rng.random():.2f}+and+watertight",
        "rejected": "/?status=rejected",
    }


def memory_mb(process: int) -> float:
    """Return the resident set of a process in megabytes."""
    return int(re.findall(r"VmRSS:\s+(\d+)", Path(f"/proc/{process}/status").read_text())[0]) / 1e3


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--twins", type=int, default=100_000)
    parser.add_argument("--requests", type=int, default=40, help="of each kind")
    parser.add_argument("--keep", type=Path, help="write the index here, or use the one that is there")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.keep or Path(scratch) / "set"
        if not (folder / "index").exists():
            write_index(DatasetRoot(folder), given.twins, 1)
        command = [sys.executable, "-m", "manitwin", "view", str(folder), "--no-browser"]
        began = time.perf_counter()
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=dict(os.environ)) as server:
            assert server.stdout is not None
            link = urlsplit(re.findall(r"http\S+", server.stdout.readline())[0])
            started = time.perf_counter() - began
            asked = http.client.HTTPConnection(link.netloc)
            asked.request("GET", f"{link.path}?{link.query}")
            answer = asked.getresponse()
            answer.read()
            cookie = str(answer.getheader("set-cookie")).split(";")[0]
            before = memory_mb(server.pid)
            rng = np.random.default_rng(0)
            taken: dict[str, list[float]] = {}
            for _ in range(given.requests):
                for kind, path in pages(rng, given.twins).items():
                    since = time.perf_counter()
                    asked.request("GET", path, headers={"cookie": cookie})
                    answer = asked.getresponse()
                    content = answer.read()
                    taken.setdefault(kind, []).append(1e3 * (time.perf_counter() - since))
                    assert answer.status == 200, content
            after = memory_mb(server.pid)
            server.send_signal(signal.SIGINT)
    print(f"{given.twins:,} twins, {given.requests} requests of each kind; listens after {started:.1f} s")
    print(f"{'page':<24} {'median ms':>10} {'p95 ms':>8} {'max ms':>8}")
    every = [each for times in taken.values() for each in times]
    for kind, times in (*taken.items(), ("all", every)):
        print(f"{kind:<24} {np.median(times):>10.0f} {np.percentile(times, 95):>8.0f} {max(times):>8.0f}")
    print(f"memory of the server: {before:.0f} MB at first, {after:.0f} MB at the end")
    met = np.percentile(every, 95) < BAR_MS and after < BAR_MB
    print(f"within {BAR_MS:.0f} ms (p95) and {BAR_MB:.0f} MB: {'yes' if met else 'NO'}")


if __name__ == "__main__":
    main()
