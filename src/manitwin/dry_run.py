"""What a build or a run would do, and about what it would cost: everything is read, nothing is written."""

from __future__ import annotations

import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

from manitwin.config import BuildConfig
from manitwin.dataset_root import DatasetRoot
from manitwin.engine.recipe import Recipe
from manitwin.errors import Rejected
from manitwin.files.image_file import check_header
from manitwin.ledger.ledger import LEDGER, Ledger
from manitwin.pipeline import TwinRecipe, estimate_usd
from manitwin.stages.stage import Item
from manitwin.store import RECORD

CHAIN_CPU_S = 13.8
SECOND_ENGINE_CPU_S = 11.1
ROBUSTNESS_CPU_S = 26.7
TRIALS_CPU_S = 6.1
"""Medians of 25 real meshes (docs/measured.md, "Twins of 25 meshes"): the whole chain with ``--quick``, what the second engine
and robustness add for each gripper, and the trials that each further gripper adds. A generator's own work is not in them."""
ENOUGH_ITEMS = 3
"""So many accepted items must there be before a data set's own rate is believed."""
MEASURED = "docs/measured.md, the median of 25 meshes"

RecordOf = Callable[[str], bytes | None]
PlannedState = Literal["to_build", "accepted", "rejected", "would_be_rejected", "duplicate"]
PLANNED_STATES: tuple[PlannedState, ...] = get_args(PlannedState)


@dataclass(frozen=True)
class PlannedItem:
    """One input: ``accepted`` and ``rejected`` are there already; ``would_be_rejected`` as it is read."""

    item: Item
    twin_id: str
    kind: str
    state: PlannedState
    detail: str = ""


@dataclass(frozen=True)
class Rate:
    """CPU seconds that an item of a kind takes, and whose figure that is."""

    cpu_s: float
    source: str


@dataclass(frozen=True)
class Plan:
    """What would be done. ``rates`` is by kind of input; results of single stages that are there are not taken off."""

    items: list[PlannedItem]
    rates: dict[str, Rate]
    usd_each: dict[str, float]
    remarks: list[str] = field(default_factory=list)

    def count(self, state: PlannedState) -> int:
        """Return how many items are in a state."""
        return sum(planned.state == state for planned in self.items)

    @property
    def to_build(self) -> Counter[str]:
        """How many items would be built, by the kind of their input."""
        return Counter(planned.kind for planned in self.items if planned.state == "to_build")

    @property
    def cpu_s(self) -> float:
        """About how much CPU time that takes."""
        return sum((number * self.rates[kind].cpu_s for kind, number in self.to_build.items()), 0.0)

    @property
    def cost_usd(self) -> float:
        """About what services would charge."""
        return sum((number * self.usd_each[kind] for kind, number in self.to_build.items()), 0.0)


def plan_build(items: Iterable[Item], out: Path, config: BuildConfig, remarks: list[str]) -> Plan:
    """Say what ``build`` would make of items in the folder ``out``."""
    recipe, usd = TwinRecipe(config), estimate_usd(config)

    def record_of(twin_id: str) -> bytes | None:
        path = out / twin_id / RECORD
        return path.read_bytes() if path.is_file() else None

    planned = list(_planned(items, recipe, config, record_of))
    return Plan(planned, dict.fromkeys(usd, measured_rate(config)), usd, remarks)


def plan_run(items: Iterable[Item], root: DatasetRoot, config: BuildConfig, remarks: list[str]) -> Plan:
    """Say what ``run`` would do for a data set: all its items, and new ones. Its ledger is read, a copy is worked on.

    ``remarks`` is filled while the items are read.
    """
    recipe, usd = TwinRecipe(config), estimate_usd(config)

    def record_of(twin_id: str) -> bytes | None:
        name = f"{recipe.folder_of(twin_id)}/{RECORD}"
        return root.read_bytes(name) if root.exists(name) else None

    with tempfile.TemporaryDirectory(prefix="manitwin-dry-run-") as scratch:
        ledger = Ledger(_copied_ledger(root, Path(scratch)))
        try:
            ledger.add_items(items)
            rates = {kind: own_rate(ledger, kind, recipe.sha256) or measured_rate(config) for kind in usd}
            rows = ledger.connection.execute("SELECT number FROM items ORDER BY number").fetchall()
            every = (ledger.item(number) for (number,) in rows)
            return Plan(list(_planned(every, recipe, config, record_of)), rates, usd, remarks)
        finally:
            ledger.close()


def measured_rate(config: BuildConfig) -> Rate:
    """Return what an item takes by the published measurements, for these grippers and engines."""
    grippers = len(config.grippers)
    each = SECOND_ENGINE_CPU_S * config.second_opinion.enabled + ROBUSTNESS_CPU_S * config.robustness.enabled
    return Rate(CHAIN_CPU_S + TRIALS_CPU_S * (grippers - 1) + each * grippers, MEASURED)


def own_rate(ledger: Ledger, kind: str, recipe_sha256: str) -> Rate | None:
    """Return what accepted items of a kind took in this data set under the same recipe; None where they are too few."""
    number, total = ledger.connection.execute(
        "SELECT count(DISTINCT i.number), coalesce(sum(s.cpu_seconds), 0) FROM items i JOIN stages s ON s.number = i.number"
        " WHERE i.state = 'accepted' AND i.kind = ? AND i.recipe_sha256 = ?",
        (kind, recipe_sha256),
    ).fetchone()
    if number < ENOUGH_ITEMS:
        return None
    return Rate(total / number, f"the mean of {number} accepted items of this data set")


def _planned(items: Iterable[Item], recipe: Recipe, config: BuildConfig, record_of: RecordOf) -> Iterator[PlannedItem]:
    seen: set[str] = set()
    for item in items:
        identity = recipe.identify(item)
        twin_id, kind = identity.twin_id, identity.kind
        if twin_id in seen:
            yield PlannedItem(item, twin_id, kind, "duplicate", "the same input as one before it")
            continue
        seen.add(twin_id)
        record = record_of(twin_id)
        ending = None if record is None else recipe.ending_of(record)
        if ending is not None:
            detail = f"{ending.reason}: {ending.detail}" if ending.reason else ending.detail
            yield PlannedItem(item, twin_id, kind, ending.status, detail)
            continue
        refused = identity.rejected or _refused_by_header(item, kind, config)
        state: PlannedState = "to_build" if refused is None else "would_be_rejected"
        yield PlannedItem(item, twin_id, kind, state, "" if refused is None else str(refused))


def _refused_by_header(item: Item, kind: str, config: BuildConfig) -> Rejected | None:
    if kind == "image" and item.file is not None:
        try:
            check_header(Path(item.file), frame=config.matting.frame)
        except Rejected as answer:
            return answer
    return None


def _copied_ledger(root: DatasetRoot, scratch: Path) -> Path:
    """Copy a data set's ledger, if it has one, with what SQLite has not yet written into it."""
    copy = scratch / LEDGER
    with suppress(FileNotFoundError):
        if root.local is None:
            root.fetch_file(LEDGER, copy)
        else:
            for suffix in ("", "-wal"):
                shutil.copyfile(f"{root.local / LEDGER}{suffix}", f"{copy}{suffix}")
    return copy
