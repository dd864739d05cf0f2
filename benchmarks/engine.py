"""Measure the overhead of the run engine: stages that do nothing, in real worker processes, with a real ledger.

    python benchmarks/engine.py [--items 10000] [--stages 10] [--jobs 2] [--curve CSV] [--ray]

Prints wall and CPU milliseconds per item and stage, and the driver's memory during the run. The CPU time is that of the driver
and the workers together. Input and assembly count as stages, because they are jobs too. ``--curve`` writes the memory as a table
of finished items and resident megabytes.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import tempfile
import time
from pathlib import Path

from manitwin.config import Resource, RunConfig
from manitwin.engine.driver import Driver
from manitwin.engine.events import ItemEnded
from manitwin.engine.executors.local import LocalExecutor
from manitwin.engine.jobs import WorkerSetup
from manitwin.engine.ledger.ledger import Ledger
from manitwin.pipeline.item import Item

TESTS = str(Path(__file__).resolve().parent.parent / "tests")
sys.path.insert(0, TESTS)
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (TESTS, os.environ.get("PYTHONPATH"))))  # for Ray's workers
from rehearsal_recipe import RehearsalRecipe  # noqa: E402

EVERY = 500


def main() -> None:
    """Run once and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--items", type=int, default=10_000)
    parser.add_argument("--stages", type=int, default=10)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--curve", type=Path)
    parser.add_argument("--ray", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        _run(Path(folder), arguments)


def _run(root: Path, arguments: argparse.Namespace) -> None:
    plan: tuple[tuple[str, Resource], ...] = tuple((f"stage_{n}", "cpu") for n in range(arguments.stages))
    recipe = RehearsalRecipe(plan)
    settings = RunConfig(cpu=arguments.jobs, index_every=0, keep_work=False)  # tables are a cost of the twins
    setup = WorkerSetup(str(root), recipe, root / "cache", keep_work=False)
    ledger = Ledger(root / "ledger.sqlite")
    ledger.add_items(Item(file=None, text=f"item {n}") for n in range(arguments.items))
    curve: list[tuple[int, float]] = []
    ended = 0

    def count(event: ItemEnded) -> None:
        nonlocal ended
        ended += 1
        if ended % EVERY == 0:
            curve.append((ended, resident_mb()))

    started, cpu_started = time.perf_counter(), cpu_seconds()
    executor = _executor(setup, settings, arguments.ray)
    try:
        result = Driver(ledger, executor, recipe, settings, on_ended=count).run()
        driver_cpu = time.process_time()
    finally:
        executor.close()
        counts = ledger.counts()
        ledger.close()
    seconds, cpu = time.perf_counter() - started, cpu_seconds() - cpu_started
    jobs = arguments.items * (arguments.stages + 2)
    print(f"{counts}, stopped: {result.stopped}")
    print(
        f"{jobs} item-stages in {seconds:.1f} s: {1e3 * seconds / jobs:.2f} ms wall, {1e3 * cpu / jobs:.2f} CPU-ms each"
    )
    print(f"of which the driver {1e3 * driver_cpu / jobs:.2f} CPU-ms")
    megabytes = [value for _, value in curve]
    if megabytes:
        tenth = megabytes[max(len(megabytes) // 10, 1) - 1]
        print(
            f"driver: {tenth:.0f} MB after a tenth of the items, {megabytes[-1]:.0f} MB at the end, {max(megabytes):.0f} MB most"
        )
    if arguments.curve:
        arguments.curve.write_text("items,driver_mb\n" + "".join(f"{n},{mb:.1f}\n" for n, mb in curve))


def _executor(setup: WorkerSetup, settings: RunConfig, ray: bool):  # type: ignore[no-untyped-def]
    if not ray:
        return LocalExecutor(setup, settings)
    from manitwin.engine.executors.ray_cluster import RayExecutor

    return RayExecutor(setup, settings, None)


def resident_mb() -> float:
    """Return the current resident memory of this process in megabytes."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def cpu_seconds() -> float:
    """Return the CPU seconds of this process and of its child processes that have ended."""
    own, children = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime


if __name__ == "__main__":
    main()
