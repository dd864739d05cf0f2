"""Drive a run on a data set: add tasks to the ledger, run their stages, and write finished folders and tables."""

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
from manitwin.engine.jobs import Executor, WorkerSetup
from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.ledger.location import CONFIG, LedgerCopy, cache_folder, local_ledger
from manitwin.engine.recipe import Recipe
from manitwin.engine.repair import heal, refuse_links
from manitwin.engine.stage_runner import sweep
from manitwin.engine.task import Payload
from manitwin.engine.worker import InlineExecutor
from manitwin.errors import UsageError, unknown_name_message
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import canonical_json

RUN = logging.getLogger("manitwin.run")
ExecutorName = Literal["local", "ray", "inline"]
EXECUTORS: tuple[ExecutorName, ...] = get_args(ExecutorName)


class RunOptions(TypedDict, total=False):
    """Options of a run that do not affect its results: where it runs, and callbacks.

    ``executor`` is "local" by default; ``address`` is that of a Ray cluster. ``on_start`` is called with the number of items in
    the data set and the number to do, ``on_stage`` and ``on_ended`` with the events of stages and items.
    """

    executor: ExecutorName
    address: str | None
    on_start: Callable[[int, int], None]
    on_stage: OnStage
    on_ended: Callable[[ItemEnded], None]


@dataclass(frozen=True)
class RunReport:
    """The result of a run: item counts by state over the whole data set, and the reason if it stopped early.

    ``left`` counts the items that wait for a service. ``given`` lists the numbers of the items that this run was given, and
    ``counts_of_given`` counts them by state; if no items were given, both refer to all items.
    """

    counts: dict[str, int]
    stopped: str | None
    left: int
    remarks: list[str] = field(default_factory=list)
    given: list[int] = field(default_factory=list)
    counts_of_given: dict[str, int] = field(default_factory=dict)

    @property
    def open(self) -> bool:
        """True if running again would continue; failed items are not retried automatically."""
        return bool(self.stopped or self.counts.get("open"))

    @property
    def exit_code(self) -> int:
        """Exit status: 0 all accepted, 3 some rejected, 4 some failed, or unfinished and resumable."""
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
    """Add tasks to the ledger below a root and process all open items with the recipe until each has ended.

    If ``recipe.replaces``, items that ended under another recipe are made again: the given items, or all if none is given. The
    report's remarks say how many are made again and how many stay as they are.

    ``configuration`` is written next to the ledger. ``remarks`` are those from reading the inputs; the number of inputs that
    were already in the data set is added. Raises UsageError for invalid arguments, or if another run is writing there.
    """
    if executor not in EXECUTORS:
        raise UsageError(unknown_name_message("executor", executor, EXECUTORS))
    path, remarks = local_ledger(root), [] if remarks is None else remarks
    refuse_links(root)
    ledger, given, new = _open_ledger_with_items(payloads, recipe, path)
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
        remarks += _other_recipe_remarks(ledger, recipe, given)
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


def _open_ledger_with_items(payloads: Iterable[Payload], recipe: Recipe, path: Path) -> tuple[Ledger, list[int], int]:
    """Open the ledger and add items; return the numbers of the given items and how many are new.

    If this fails, a newly created ledger is removed.
    """
    made_folder = not path.parent.exists()
    ledger = Ledger(path)
    try:
        ledger.rewrite_payloads(recipe.payload.from_json)
        given, new = ledger.add_items(payloads)
        ledger.reopen(ledger.changed_since_end(given, recipe.payload.from_json))
        return ledger, given, new
    except BaseException:
        ledger.close(remove_new=True)
        if made_folder:
            with suppress(OSError):  # not empty: another run has started there
                path.parent.rmdir()
        raise


def _other_recipe_remarks(ledger: Ledger, recipe: Recipe, given: list[int]) -> list[str]:
    """Return remarks on items that ended under another recipe: how many are made again, and how many stay as they are."""
    others = len(ledger.ended_under_other_recipes(recipe.sha256))
    if not recipe.replaces:
        stay = others - len(ledger.ended_under_other_recipes(recipe.sha256, replaces=False))
        made = "made by another version of manitwin, or with another version of a file that the settings name"
        return (
            [
                f"{stay} existing items were {made}, and stay unchanged; use a new folder to make all of them the same"
                f" way"
            ]
            if stay
            else []
        )
    again = len(ledger.ended_under_other_recipes(recipe.sha256, given))
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
