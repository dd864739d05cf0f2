"""Rehearsed runs on a cluster: real ledgers, folders and workers, stages that do nothing or fail as told."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from manitwin.config import RunConfig
from manitwin.dataset.check import disagreements
from manitwin.dataset.index.parts import IndexTables
from manitwin.engine.driver import Driver
from manitwin.engine.events import ItemEnded
from manitwin.engine.executors.ray_cluster import RayExecutor
from manitwin.engine.jobs import RunStage, WorkerSetup
from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.stage_runner import sweep as sweep_work
from manitwin.engine.task import Task
from manitwin.pipeline.item import Item
from manitwin.twin.dataset_root import DatasetRoot
from rehearsal_recipe import RehearsalRecipe

ASKS = (("a", "cpu"), ("b", "vlm"), ("c", "cpu"))


@dataclass
class Ran:
    """What a run left."""

    ended: list[ItemEnded]
    states: dict[str, str]
    errors: dict[tuple[str, str], str | None]
    attempts: dict[tuple[str, str], int]
    wrong: list[str]
    stopped: str | None


def asking(log: Path) -> RehearsalRecipe:
    return RehearsalRecipe(ASKS, log=log)


def run(
    root: Path,
    texts: Iterable[str],
    *,
    recipe: RehearsalRecipe,
    address: str,
    on_ended: Callable[[ItemEnded], None] = lambda event: None,
    **values: Any,
) -> Ran:
    """Run once on the cluster."""
    settings = RunConfig(index_every=10**6, **({"patience_s": 60.0} | values))
    recipe = replace(recipe, tables=IndexTables())
    ended: list[ItemEnded] = []

    def heard(event: ItemEnded) -> None:
        ended.append(event)
        on_ended(event)

    ledger = Ledger(root / "ledger.sqlite")
    try:
        ledger.add_items(Item(file=None, text=text) for text in texts)
        with RayExecutor(WorkerSetup(str(root), recipe, root / "cache", True), settings, address) as executor:
            sweep = partial(sweep_work, DatasetRoot(root))
            result = Driver(ledger, executor, recipe, settings, on_ended=heard, sweep=sweep).run()
        rows = ledger.connection.execute(
            "SELECT json_extract(item, '$.text'), stage, s.attempts, s.error FROM items JOIN stages s USING (number)"
        ).fetchall()
        states = dict(ledger.connection.execute("SELECT json_extract(item, '$.text'), state FROM items").fetchall())
        wrong = [found.what for found in disagreements(ledger, DatasetRoot(root), True)]
    finally:
        ledger.close()
    errors = {(text, stage): error for text, stage, _, error in rows}
    attempts = {(text, stage): count for text, stage, count, _ in rows}
    return Ran(ended, states, errors, attempts, wrong, result.stopped)


def times_run(log: Path) -> Counter[str]:
    """How often each stage of each twin was begun."""
    return Counter(log.read_text().splitlines() if log.exists() else ())


def executor_for(root: Path, recipe: RehearsalRecipe, address: str, **values: Any) -> RayExecutor:
    settings = RunConfig(**values)
    return RayExecutor(WorkerSetup(str(root), recipe, root / "cache", True), settings, address)


def stage_job(number: int, text: str, recipe: RehearsalRecipe, stage: str = "a") -> RunStage:
    """The first stage of an item."""
    item = Item(file=None, text=text)
    return RunStage(Task(number, item, recipe.identify(item).item_id), "text", 0, stage, recipe.plan[0][1], ())


def replies(executor: RayExecutor, count: int, within_s: float = 600) -> Iterator[tuple[int, Any]]:
    """The next replies."""
    until = time.monotonic() + within_s
    while count:
        assert time.monotonic() < until, "no reply in time"
        for ticket, reply in executor.ended(0.5):
            count -= 1
            yield ticket, reply


def replies_after(executor: RayExecutor, seconds: float) -> Iterator[tuple[int, Any]]:
    """What is answered in so many seconds."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        yield from executor.ended(0.2)
