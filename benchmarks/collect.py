"""Time a catalogue with many rows: adding a list of addresses, adding it again, its status, and a plan.

    python benchmarks/collect.py [--rows N]

Addresses, categories (those of the priors), sources, licences and sizes are drawn at random. The columns are wall and CPU
seconds. The status is the best of five runs, each with a new connection and the file in the operating system's cache. The plan
treats the addresses as files. The exit status is 1 if the status takes more than 0.2 s or the plan more than 10 s.
"""

from __future__ import annotations

import argparse
import json
import random
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from manitwin.dataset.collect.intake import DefaultValues, add_inputs
from manitwin.dataset.collect.plan_files import write_plan
from manitwin.dataset.collect.planning import plan_inputs
from manitwin.dataset.collect.status import catalogue_status
from manitwin.dataset.collect.store import Catalogue
from manitwin.models.annotators.priors import load_priors

BAR_S, PLAN_BAR_S = 0.2, 10.0
REPEATS = 5
LICENCES = ("CC0-1.0", "CC-BY-4.0", "CC-BY-SA-4.0", "CC-BY-NC-4.0", "MIT", "Apache-2.0", "proprietary", "unknown")


def write_list(path: Path, count: int) -> None:
    """Write a list of ``count`` random addresses as JSON Lines."""
    draw = random.Random(0)
    names = [*load_priors(), "thing nobody knows"]
    with path.open("w") as stream:
        for number in range(count):
            row = {
                "url": f"https://example.org/{draw.randrange(10**12)}/{number}.jpg",
                "name": draw.choice(names),
                "source": f"shop {draw.randrange(20)}",
                "license": draw.choice(LICENCES),
                "size_m": round(draw.uniform(0.01, 0.5), 4),
            }
            stream.write(json.dumps(row) + "\n")


def timed(what: str, do: Callable[[], object], repeats: int = 1) -> float:
    """Print the wall and CPU seconds of the best of some repetitions, and return the wall seconds."""
    best = (float("inf"), float("inf"))
    for _ in range(repeats):
        wall, cpu = time.perf_counter(), time.process_time()
        do()
        best = min(best, (time.perf_counter() - wall, time.process_time() - cpu))
    print(f"{what:<40} {best[0]:8.3f} s {best[1]:8.3f} CPU-s")
    return best[0]


def main() -> None:
    """Make the catalogue and time the operations."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=100_000)
    count = parser.parse_args().rows
    with tempfile.TemporaryDirectory() as made:
        listed, catalogue = Path(made, "list.jsonl"), Path(made, "catalogue.db")
        write_list(listed, count)
        timed(f"add {count:,} rows", lambda: add_inputs(catalogue, listed, DefaultValues()))
        timed("add them again", lambda: add_inputs(catalogue, listed, DefaultValues()))
        status = timed("status", lambda: catalogue_status(catalogue), REPEATS)
        print(f"{catalogue.stat().st_size / 1e6:.1f} MB")
        with Catalogue(catalogue) as opened:
            rows = [replace(row, kind="image") for row in opened.ready()]
        plan = timed(f"plan of {count:,}", lambda: write_plan(plan_inputs(rows, count), Path(made, "plan")))
    raise SystemExit(int(status > BAR_S or plan > PLAN_BAR_S))


if __name__ == "__main__":
    main()
