"""Drive a run below a root: tasks in, a ledger that says what became of each, finished folders and tables out."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, closing, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypedDict, get_args

from manitwin.config import RunConfig
from manitwin.engine.driver import Driver
from manitwin.engine.events import ItemEnded, OnStage
from manitwin.engine.healing import heal, refuse_links
from manitwin.engine.jobs import Executor, WorkerSetup
from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.ledger.location import CONFIG, LedgerCopy, cache_folder, local_ledger
from manitwin.engine.recipe import Recipe
from manitwin.engine.stage_runner import sweep
from manitwin.engine.task import Payload
from manitwin.engine.worker import InlineExecutor
from manitwin.errors import UsageError, choose_from
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import canonical_json

RUN = logging.getLogger("manitwin.run")
ExecutorName = Literal["local", "ray", "inline"]
EXECUTORS: tuple[ExecutorName, ...] = get_args(ExecutorName)


class RunOptions(TypedDict, total=False):
    """Options of a run that decide nothing of its results: where it runs, and the callbacks of those who watch it.

    ``executor`` is local by default; ``address`` is that of a Ray cluster. ``on_start`` is called with the number of items of
    the data set and of those to do, ``on_stage`` and ``on_ended`` with the events of stages and items.
    """

    executor: ExecutorName
    address: str | None
    on_start: Callable[[int, int], None]
    on_stage: OnStage
    on_ended: Callable[[ItemEnded], None]


@dataclass(frozen=True)
class RunReport:
    """The outcome of a run: items of the whole data set by state, and why it stopped where it did before its end.

    ``left`` counts the items that wait for a service. ``given`` are the numbers of those that this run was given, and
    ``counts_of_given`` has them by state; where none was given, all are meant.
    """

    counts: dict[str, int]
    stopped: str | None
    left: int
    remarks: list[str] = field(default_factory=list)
    given: list[int] = field(default_factory=list)
    counts_of_given: dict[str, int] = field(default_factory=dict)

    @property
    def open(self) -> bool:
        """True where the same run again would go on: what failed is not tried again by itself."""
        return bool(self.stopped or self.counts.get("open"))

    @property
    def exit_code(self) -> int:
        """0 all accepted, 3 some rejected, 4 some failed, or open and resumable."""
        if self.open or self.counts.get("failed"):
            return 4
        return 3 if self.counts.get("rejected") else 0


def drive(
    recipe: Recipe,
    payloads: Iterable[Payload],
    root: DatasetRoot,
    settings: RunConfig,
    *,
    configuration: dict[str, Any],
    executor: ExecutorName = "local",
    address: str | None = None,
    max_cost_usd: float | None = None,
    remarks: list[str] | None = None,
    on_start: Callable[[int, int], None] = lambda items, opened: None,
    on_stage: OnStage = lambda event: None,
    on_ended: Callable[[ItemEnded], None] = lambda event: None,
) -> RunReport:
    """Add tasks to the ledger below a root and make of each what the recipe says, until all that are open have ended.

    Items that ended under another recipe are made again where the recipe replaces them: those that are given, or all where none
    is. What is made again for that, and what stays, is remarked.
    ``configuration`` is left beside the ledger. What was remarked while they were read is in ``remarks``,
    and how many were there already is added to it. Raises UsageError for wrong arguments, or where another run is at work there.
    """
    if executor not in EXECUTORS:
        raise UsageError(choose_from("executor", executor, EXECUTORS))
    path, remarks = local_ledger(root), [] if remarks is None else remarks
    refuse_links(root)
    ledger, given, new = _opened_with(payloads, recipe, path)
    copy = LedgerCopy(root, path)

    def ended(event: ItemEnded) -> None:
        on_ended(event)
        copy.refresh()

    try:
        if len(given) > new:
            remarks.append(f"{len(given) - new} of {len(given)} items were in the data set already")
        remarks += heal(ledger, root, recipe, given)
        root.write_bytes(CONFIG, canonical_json(configuration).encode())
        setup = WorkerSetup(root.url, recipe, cache_folder(root), settings.keep_work, settings.memory_gb)
        remarks += _of_others(ledger, recipe, given)
        items, opened = ledger.totals(recipe.sha256, given, replaces=recipe.replaces)
        with _executor(executor, address, setup, settings, opened, remarks) as engine:
            driver = Driver(
                ledger, engine, recipe, settings, on_ended=ended, on_stage=on_stage, sweep=partial(sweep, root),
                remove=lambda item_id: root.remove(recipe.folder_of(item_id)), max_cost_usd=max_cost_usd, given=given,
            )  # fmt: skip
            on_start(items, opened)
            result = driver.run()
        counts = ledger.counts()
        said = ", ".join(f"{count} {state}" for state, count in counts.items() if count)
        RUN.info("run ends: %s; %s", result.stopped or "finished", said)
        return RunReport(counts, result.stopped, result.left, remarks, given, ledger.counts(given) if given else counts)
    finally:
        ledger.close()
        copy.upload()


def _opened_with(payloads: Iterable[Payload], recipe: Recipe, path: Path) -> tuple[Ledger, list[int], int]:
    """Open the ledger and add items; returns the given ones' numbers and how many are new. A new one that fails is removed."""
    made_folder = not path.parent.exists()
    ledger = Ledger(path)
    try:
        ledger.restate(recipe.payload.from_json)
        given, new = ledger.add_items(payloads)
        ledger.reopen(ledger.changed_since_end(given, recipe.payload.from_json))
        return ledger, given, new
    except BaseException:
        ledger.close(remove_new=True)
        if made_folder:
            with suppress(OSError):  # not empty: another run has begun there
                path.parent.rmdir()
        raise


def _of_others(ledger: Ledger, recipe: Recipe, given: list[int]) -> list[str]:
    """Return remarks about items that ended under another recipe: how many are made again, how many stay as they were made."""
    others = len(ledger.ended_under_others(recipe.sha256))
    if not recipe.replaces:
        stay = others - len(ledger.ended_under_others(recipe.sha256, replaces=False))
        made = "made by another version of manitwin, or with another version of a file that the settings name"
        return (
            [
                f"{stay} existing items were {made}, and stay unchanged; use a new folder to make all of them the same"
                f" way"
            ]
            if stay
            else []
        )
    again = len(ledger.ended_under_others(recipe.sha256, given))
    made = "made by another version of manitwin or with other settings"
    remarks = [f"{again} were {made}: {recipe.made_again}"] if again else []
    if others > again:
        remarks.append(
            f"{others - again} items outside these inputs were {made}, and stay unchanged; a build without"
            f" inputs updates them too"
        )
    return remarks


def _executor(
    name: str, address: str | None, setup: WorkerSetup, settings: RunConfig, items: int, remarks: list[str]
) -> AbstractContextManager[Executor]:
    if name == "local":
        from manitwin.engine.executors.local import LocalExecutor

        return LocalExecutor(setup, settings, items, tell=remarks.append)
    if name == "inline":
        return closing(InlineExecutor(setup))
    from manitwin.engine.executors.ray_cluster import RayExecutor

    return RayExecutor(setup, settings, address)
