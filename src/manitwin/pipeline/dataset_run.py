"""Build a data set: a manifest in, a ledger that says what became of each item, twins and tables out."""

from __future__ import annotations

import hashlib
import json
import logging
import os
import sqlite3
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, closing, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal, get_args

from pydantic import ValidationError

from manitwin.config import BuildConfig, RunConfig
from manitwin.engine.driver import Driver
from manitwin.engine.events import ItemEnded, OnStage
from manitwin.engine.executor import Executor, InlineExecutor
from manitwin.engine.jobs import WorkerSetup
from manitwin.engine.ledger.ledger import LEDGER, Ledger, read_ledger
from manitwin.engine.recipe import Recipe, Tables
from manitwin.engine.task import Payload
from manitwin.engine.work import WorkFolder
from manitwin.errors import UsageError, choose_from
from manitwin.formats.output_folder import require_writable_folder
from manitwin.pipeline.folder_listing import FolderListing
from manitwin.pipeline.manifest import Notes, iterate_items
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import canonical_json

RUN = logging.getLogger("manitwin.run")
CONFIG = "config.json"
RUN_LOG = "run.log"
COPY_EVERY_S = 60.0
ExecutorName = Literal["local", "ray", "inline"]
EXECUTORS: tuple[ExecutorName, ...] = get_args(ExecutorName)


@dataclass(frozen=True)
class RunReport:
    """How a run ended: items of the whole data set by state, and why it stopped where it did before its end.

    ``folders`` says what became of every file of a folder given to it.
    """

    counts: dict[str, int]
    stopped: str | None
    left: int
    remarks: list[str] = field(default_factory=list)
    folders: list[FolderListing] = field(default_factory=list)

    @property
    def open(self) -> bool:
        """Whether the same run again would go on: what failed is not tried again by itself."""
        return bool(self.stopped or self.counts.get("open"))

    @property
    def exit_code(self) -> int:
        """0 all accepted, 3 some rejected, 4 some failed, or open and resumable."""
        if self.open or self.counts.get("failed"):
            return 4
        return 3 if self.counts.get("rejected") else 0


def run(
    inputs: Iterable[str | Path],
    dataset: str | Path,
    *,
    tables: Tables,
    config: BuildConfig | None = None,
    executor: ExecutorName = "local",
    address: str | None = None,
    defaults: dict[str, str | None] | None = None,
    texts: Iterable[str] = (),
    strict: bool = False,
    on_estimate: Callable[[dict[str, float]], None] = lambda usd_by_kind: None,
    on_start: Callable[[int, int], None] = lambda items, opened: None,
    on_stage: OnStage = lambda event: None,
    on_ended: Callable[[ItemEnded], None] = lambda event: None,
) -> RunReport:
    """Add items to a data set and work until all of it has ended; with no inputs, go on with what is there.

    ``tables`` are kept of the twins.
    ``config`` None: the data set's own. A changed configuration does again what it touches. ``strict``: a manifest's column
    that nobody knows is an error. Raises UsageError for
    wrong arguments, or where another run is at work on the data set. What becomes of an item is in the ledger.
    """
    from manitwin.pipeline.generator_input import refusal

    # two CPU-seconds to import, which `status` does without
    from manitwin.pipeline.recipe import TwinRecipe, check_names, estimate_usd, log_choices

    root, given, words = DatasetRoot(dataset), list(inputs), list(texts)
    require_work(root, given, words)
    settings = config or stored_config(root)
    check_names(settings)
    log_choices(settings)
    notes = Notes()

    def started(items: int, opened: int) -> None:
        on_estimate(estimate_usd(settings))
        on_start(items, opened)

    report = drive(
        TwinRecipe(settings, tables),
        iterate_items(given, defaults or {}, notes, words, strict=strict, refusal=refusal(settings)),
        root,
        settings.run,
        configuration=settings.model_dump(mode="json"),
        executor=executor,
        address=address,
        max_cost_usd=settings.services.max_cost_usd,
        remarks=notes.remarks,
        on_start=started,
        on_stage=on_stage,
        on_ended=on_ended,
    )
    return replace(report, folders=notes.folders)


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
    """Add tasks to the ledger below a root and make of each what the recipe says, until all have ended.

    ``configuration`` is left beside the ledger. What was remarked while they were read is in ``remarks``,
    and how many were there already is added to it. Raises
    UsageError for wrong arguments, or where another run is at work there.
    """
    if executor not in EXECUTORS:
        raise UsageError(choose_from("executor", executor, EXECUTORS))
    path = local_ledger(root)
    ledger, given, new = _opened_with(payloads, recipe, path)
    try:
        if remarks is not None and given > new:
            remarks.append(f"{given - new} of {given} items were in the data set already")
        root.write_bytes(CONFIG, canonical_json(configuration).encode())
        setup = WorkerSetup(root.url, recipe, cache_folder(root), settings.keep_work)
        copy = _LedgerCopy(root, path)
        with _executor(executor, address, setup, settings) as engine:
            driver = Driver(
                ledger, engine, recipe, settings, on_ended=_both(on_ended, copy), on_stage=on_stage, sweep=partial(sweep, root),
                max_cost_usd=max_cost_usd,
            )  # fmt: skip
            on_start(*ledger.totals(recipe.sha256))
            result = driver.run()
        counts = ledger.counts()
        said = ", ".join(f"{count} {state}" for state, count in counts.items() if count)
        RUN.info("run ends: %s; %s", result.stopped or "finished", said)
        return RunReport(counts, result.stopped, result.left, [] if remarks is None else remarks)
    finally:
        ledger.close()
        _LedgerCopy(root, path).upload()


def _opened_with(payloads: Iterable[Payload], recipe: Recipe, path: Path) -> tuple[Ledger, int, int]:
    """Open the ledger and add items to it; returns how many were given and are new. Where that fails, a new one is removed."""
    made_folder = not path.parent.exists()
    ledger = Ledger(path)
    try:
        ledger.restate(recipe.payload.from_json)
        return ledger, *ledger.add_items(payloads)
    except BaseException:
        ledger.close(remove_new=True)
        if made_folder:
            with suppress(OSError):  # not empty: another run has begun there
                path.parent.rmdir()
        raise


def require_work(root: DatasetRoot, inputs: Sequence[str | Path], texts: Sequence[str]) -> None:
    """Raise UsageError where a run has no inputs and its data set is not there, and where that cannot be made or written."""
    if not inputs and not texts and not root.exists(CONFIG) and not root.exists(LEDGER):
        raise UsageError(f"{root.url}: no data set there to go on with; give a manifest, files, folders or --text")
    if root.local is not None:
        require_writable_folder(root.local)


def stored_config(root: DatasetRoot) -> BuildConfig:
    """Return the configuration of a data set, the defaults for a new one. Raises UsageError where it cannot be read."""
    if not root.exists(CONFIG):
        return BuildConfig()
    try:
        said = json.loads(root.read_bytes(CONFIG))
        if isinstance(said, dict) and "kind" in said:
            raise UsageError(f"{root.url}: holds {said['kind']}, not twins; give the data set that they are of")
        return BuildConfig(**said)
    except (ValueError, ValidationError) as error:
        raise UsageError(
            f"{root.url}/{CONFIG}: not a configuration of this version ({str(error).splitlines()[0]}); give --config"
        ) from error


def ledger_path(root: DatasetRoot) -> Path:
    """Return where the ledger lies on this machine: in the data set, or of a URL in the user's state folder."""
    if root.local is not None:
        return root.local / LEDGER
    state = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local/state") / "manitwin"
    return state / f"{_digest(root.url)}.sqlite"


def local_ledger(root: DatasetRoot) -> Path:
    """Return the path of the ledger; of a URL it is made from the copy there where this machine has none."""
    path = ledger_path(root)
    if root.local is None and not path.is_file() and root.exists(LEDGER):
        root.fetch_file(LEDGER, path)
    return path


def copy_ledger(root: DatasetRoot, copy: Path) -> None:
    """Copy the ledger that a run would take up, also while one writes it; there is no copy where there is no ledger."""
    path = ledger_path(root)
    if path.is_file():
        with read_ledger(path) as source, closing(sqlite3.connect(copy)) as target:
            source.backup(target)
    elif root.local is None and root.exists(LEDGER):
        root.fetch_file(LEDGER, copy)


def local_log(root: DatasetRoot) -> Path:
    """Return the path of the log of a data set's runs: beside the ledger."""
    ledger = local_ledger(root)
    return ledger.with_name(RUN_LOG) if root.local is not None else ledger.with_suffix(".log")


def cache_folder(root: DatasetRoot) -> Path:
    """Return where a worker keeps copies of what lies at a URL; of a local data set nothing is copied."""
    if root.local is not None:
        return root.local
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return home / "manitwin" / _digest(root.url)


def sweep(root: DatasetRoot, twin_id: str) -> None:
    """Delete what workers left half-made of a twin."""
    WorkFolder(root, twin_id, cache_folder(root)).sweep()


def _digest(url: str) -> str:
    return hashlib.sha256(url.encode()).hexdigest()[:16]


def _executor(
    name: str, address: str | None, setup: WorkerSetup, settings: RunConfig
) -> AbstractContextManager[Executor]:
    if name == "local":
        from manitwin.engine.executors.local import LocalExecutor

        return LocalExecutor(setup, settings)
    if name == "inline":
        return closing(InlineExecutor(setup))
    from manitwin.engine.executors.ray_cluster import RayExecutor

    return RayExecutor(setup, settings, address)


def _both(first: Callable[[ItemEnded], None], second: Callable[[ItemEnded], None]) -> Callable[[ItemEnded], None]:
    def call(event: ItemEnded) -> None:
        first(event)
        second(event)

    return call


class _LedgerCopy:
    """Keeps a copy of the ledger beside the twins of a URL: the machine of the driver may be lost as well."""

    def __init__(self, root: DatasetRoot, path: Path):
        self._root, self._path, self._at = root, path, time.monotonic()

    def __call__(self, event: ItemEnded) -> None:
        if time.monotonic() - self._at > COPY_EVERY_S:
            self.upload()

    def upload(self) -> None:
        if self._root.local is not None:
            return
        with tempfile.NamedTemporaryFile(suffix=".sqlite") as copy:
            with closing(sqlite3.connect(self._path)) as source, closing(sqlite3.connect(copy.name)) as target:
                source.backup(target)
            self._root.put_file(Path(copy.name), LEDGER)
        self._at = time.monotonic()
