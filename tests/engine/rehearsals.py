"""Rehearsed runs: real ledgers, folders and workers, stages that do nothing or fail as told."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from manitwin.config import RunConfig
from manitwin.dataset.check import disagreements
from manitwin.dataset.index.parts import IndexTables
from manitwin.engine.driver import Driver, RunResult
from manitwin.engine.events import ItemEnded, OnStage
from manitwin.engine.executors.local import LocalExecutor
from manitwin.engine.jobs import WorkerSetup
from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.stage_runner import sweep as sweep_work
from manitwin.engine.worker import InlineExecutor
from manitwin.pipeline.item import Item
from manitwin.twin.dataset_root import DatasetRoot
from rehearsal_recipe import RehearsalRecipe


@dataclass
class Rehearsed:
    """A data set after a run, and what the run said."""

    root: DatasetRoot
    result: RunResult
    ended: list[ItemEnded]
    states: dict[str, str]
    attempts: dict[tuple[str, str], int]
    errors: dict[tuple[str, str], str | None]
    costs_usd: dict[tuple[str, str], float]
    wrong: list[str]


def items(texts: Iterable[str]) -> list[Item]:
    """One item a text."""
    return [Item(file=None, text=text) for text in texts]


def rehearse(
    root: str | Path,
    texts: Iterable[str] = (),
    *,
    recipe: RehearsalRecipe,
    settings: RunConfig | None = None,
    ledger_folder: Path | None = None,
    processes: bool = False,
    max_cost_usd: float | None = None,
    on_stage: OnStage = lambda event: None,
) -> Rehearsed:
    """Run once, in this process or in workers."""
    settings = settings or RunConfig(patience_s=0)
    recipe = replace(recipe, tables=IndexTables())
    where = DatasetRoot(root)
    folder = ledger_folder or Path(root)
    setup = WorkerSetup(str(root), recipe, folder / "cache", settings.keep_work)
    ledger = Ledger(folder / "ledger.sqlite")
    executor = LocalExecutor(setup, settings) if processes else InlineExecutor(setup)
    ended: list[ItemEnded] = []
    try:
        ledger.add_items(items(texts))
        sweep = partial(sweep_work, where)
        driver = Driver(
            ledger, executor, recipe, settings, on_ended=ended.append, sweep=sweep, max_cost_usd=max_cost_usd,
            remove=lambda item_id: where.remove(recipe.folder_of(item_id)), on_stage=on_stage,
        )  # fmt: skip
        result = driver.run()
        wrong = [found.what for found in disagreements(ledger, where, settings.keep_work)]
        rows = ledger.connection.execute(
            "SELECT json_extract(item, '$.text'), stage, s.attempts, s.error, s.cost_usd FROM items JOIN stages s USING (number)"
        ).fetchall()
        states = dict(ledger.connection.execute("SELECT json_extract(item, '$.text'), state FROM items").fetchall())
    finally:
        executor.close()
        ledger.close()
    attempts = {(text, stage): count for text, stage, count, _, _ in rows}
    errors = {(text, stage): error for text, stage, _, error, _ in rows}
    costs = {(text, stage): usd for text, stage, _, _, usd in rows}
    return Rehearsed(where, result, ended, states, attempts, errors, costs, wrong)


def runs(log: Path) -> Counter[tuple[str, str]]:
    """Count how often each stage of each twin was begun."""
    lines = log.read_text().splitlines() if log.exists() else []
    return Counter((line.split()[0], line.split()[1]) for line in lines)
