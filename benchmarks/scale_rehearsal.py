"""Simulate a run of very many items: the real driver and ledger, with workers that return recorded stage costs.

    python benchmarks/scale_rehearsal.py DATASET [--items 1000000] [--cores 1024] [--curve CSV]

``DATASET`` has finished twins; each item takes the stages and the seconds of one of them, drawn at random. No stage runs and no
folder is written. A simulated pool of ``--cores`` cores ends each job when its seconds are over. The simulated clock also
advances by the time that the driver takes, so that a driver that is too slow leaves cores idle. Prints the hours that the run
would have taken, the utilisation of its cores, and the measured figures: the driver's CPU per item and stage, its memory during
the run, and the size of the ledger.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from dataclasses import dataclass
from heapq import heappop, heappush, heapreplace
from pathlib import Path

import numpy as np

from engine import TESTS, resident_mb
from manitwin.config import Resource, RunConfig
from manitwin.engine.driver import Driver
from manitwin.engine.events import ItemEnded
from manitwin.engine.jobs import Finish, Job, Reply, RunStage, Survey, SurveyReply
from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.recipe import Ending
from manitwin.engine.stage import StagePart
from manitwin.engine.stage_runner import StageCost, StageRun
from manitwin.pipeline.item import Item
from manitwin.pipeline.stage_order import place_in_pipeline

sys.path.insert(0, TESTS)
from rehearsal_recipe import RehearsalRecipe

SURVEY_S, FINISH_S = 0.02, 0.15  # hashing an input, assembling a folder (8 meshes of 1 to 3 MB)
CURVE_POINTS = 20
KEY = "0123456789abcdef01234567"


@dataclass(frozen=True)
class Recorded:
    """The costs of one twin's stages, by name."""

    stages: dict[str, StageCost]


def recorded(data: Path) -> list[Recorded]:
    """Read the stage costs of all finished twins of a data set."""
    runs = [json.loads(path.read_text())["stages"] for path in sorted(data.glob("twins/*/*/run.json"))]
    return [Recorded({name: StageCost(**cost) for name, cost in run.items()}) for run in runs]


class RecordedPool:
    """An executor of simulated cores.

    ``now_s`` is the simulated time. It advances to the next end of a job, and by the seconds that the driver took since its last
    call.
    """

    def __init__(self, runs: list[Recorded], cores: int):
        self._runs, self._cores = runs, [0.0] * cores
        self._ends: list[tuple[float, int, Reply]] = []
        self._asked = time.perf_counter()
        self.now_s = self.busy_s = 0.0

    def slots(self, needs: Resource) -> int:
        """Return the number of cores."""
        return len(self._cores)

    def submit(self, ticket: int, job: Job) -> None:
        """Assign a job to the core that is free first."""
        seconds, reply = self._answer(job)
        end = max(self._cores[0], self.now_s) + seconds
        heapreplace(self._cores, end)
        heappush(self._ends, (end, ticket, reply))
        self.busy_s += seconds

    def ended(self, timeout_s: float) -> list[tuple[int, Reply]]:
        """Return the jobs that have ended by now, or wait for the next one if none has."""
        self.now_s += time.perf_counter() - self._asked
        ended = []
        if self._ends:
            self.now_s = max(self.now_s, self._ends[0][0])
        while self._ends and self._ends[0][0] <= self.now_s:
            _, ticket, reply = heappop(self._ends)
            ended.append((ticket, reply))
        self._asked = time.perf_counter()
        return ended

    def parts(self) -> dict[int, StagePart]:
        """Return nothing, because no stage reports its parts."""
        return {}

    def close(self) -> None:
        """Do nothing, because nothing is open."""

    def _answer(self, job: Job) -> tuple[float, Reply]:
        if isinstance(job, Survey):
            return SURVEY_S, SurveyReply(f"{job.task.number:016x}", "mesh")
        if isinstance(job, RunStage):
            cost = self._runs[job.task.number % len(self._runs)].stages.get(job.stage, StageCost(0.0, 0.0, 0.0))
            return cost.cpu_seconds, StageRun(KEY, cost, False)
        assert isinstance(job, Finish)
        return FINISH_S, Ending("accepted", KEY * 2, None, "95 of 100 grasps verified")


def main() -> None:
    """Run once and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("--items", type=int, default=1_000_000)
    parser.add_argument("--cores", type=int, default=1024)
    parser.add_argument("--curve", type=Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        _run(Path(folder), arguments)


def _run(root: Path, arguments: argparse.Namespace) -> None:
    runs = recorded(arguments.data)
    shuffled = np.random.default_rng(0).permutation(len(runs))
    runs = [runs[index] for index in shuffled]
    names = sorted({name for run in runs for name in run.stages}, key=place_in_pipeline)
    recipe = RehearsalRecipe(tuple((name, "cpu") for name in names))
    ledger = Ledger(root / "ledger.sqlite")
    started = time.process_time()
    ledger.add_items(Item(file=f"/data/meshes/{n:07d}/model.glb", text=None) for n in range(arguments.items))
    print(
        f"{arguments.items} items added in {time.process_time() - started:.1f} CPU-s, {size_mb(root):.0f} MB",
        flush=True,
    )
    pool = RecordedPool(runs, arguments.cores)
    curve: list[tuple[int, float, float, float, float]] = []
    ended, every = 0, max(1, arguments.items // CURVE_POINTS)
    started = time.process_time()

    def count(event: ItemEnded) -> None:
        nonlocal ended
        ended += 1
        if ended % every == 0:
            row = (ended, time.process_time() - started, resident_mb(), size_mb(root), pool.now_s / 3600)
            curve.append(row)
            print(
                "items {}, driver {:.0f} CPU-s, {:.0f} MB, ledger {:.0f} MB, hours of the run {:.2f}".format(*row),
                flush=True,
            )

    settings = RunConfig(index_every=0, in_flight=max(1000, 4 * arguments.cores))
    result = Driver(ledger, pool, recipe, settings, on_ended=count).run()
    cpu_s = time.process_time() - started
    ledger.close()
    jobs = arguments.items * (len(names) + 2)
    print(f"{ended} ended, stopped: {result.stopped}; {len(names)} stages, {jobs} item-stages")
    print(
        f"driver: {1e3 * cpu_s / jobs:.3f} CPU-ms an item-stage, {cpu_s / 3600:.2f} CPU-hours, {resident_mb():.0f} MB at the end"
    )
    print(f"ledger: {size_mb(root):.0f} MB, {1e6 * size_mb(root) / arguments.items:.0f} bytes an item")
    share = pool.busy_s / (arguments.cores * pool.now_s)
    print(f"the run: {pool.now_s / 3600:.2f} hours on {arguments.cores} cores, {100 * share:.0f} % of them busy")
    print(f"one such driver keeps {pool.busy_s / jobs / (cpu_s / jobs):.0f} cores busy at most, on a core of its own")
    if arguments.curve:
        lines = [",".join(f"{value:.3f}" for value in row) for row in curve]
        arguments.curve.write_text("items,driver_cpu_s,driver_mb,ledger_mb,hours\n" + "\n".join(lines) + "\n")


def size_mb(root: Path) -> float:
    """Return the size of the ledger including its log, megabytes."""
    return sum(path.stat().st_size for path in root.glob("ledger.sqlite*")) / 1e6


if __name__ == "__main__":
    main()
