"""What a build would do, and about what it would cost: everything is read, nothing is written."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from statistics import fmean
from typing import Literal, get_args

from manitwin.cli.measured_rates import Rate, measured_rate
from manitwin.config import BuildConfig
from manitwin.engine.amendments import amendments_sha256, read_amendments
from manitwin.engine.ledger.ledger import LEDGER, Ledger
from manitwin.engine.ledger.location import copy_ledger
from manitwin.engine.recipe import Ending, Recipe
from manitwin.errors import NewerVersion, TwinError
from manitwin.pipeline.inspection import NotInspected, inspect_identity
from manitwin.pipeline.item import Item
from manitwin.pipeline.recipe import TwinRecipe, describe_differences, estimate_usd
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import RECORD, parse_record

ENOUGH_ITEMS = 3
"""How many accepted items a data set must have before its own rate is used."""

RecordOf = Callable[[str], bytes | None]
PlannedState = Literal["to_build", "accepted", "rejected", "failed", "would_be_rejected", "duplicate"]
PLANNED_STATES: tuple[PlannedState, ...] = get_args(PlannedState)


@dataclass(frozen=True)
class PlannedItem:
    """One input: ``accepted`` and ``rejected`` are there already, ``failed`` waits for ``manitwin retry``.

    ``would_be_rejected`` is what it would be as it is read. ``twin_id`` and ``kind`` are None where it failed before they were
    known.
    """

    item: Item
    twin_id: str | None
    kind: str | None
    state: PlannedState
    detail: str = ""


@dataclass(frozen=True)
class Plan:
    """The work that a build would do. ``rates`` is by kind of input; stages that are done already are not taken off."""

    items: list[PlannedItem]
    rates: dict[str, Rate]
    usd_each: dict[str, float]
    remarks: list[str] = field(default_factory=list)

    def count(self, state: PlannedState) -> int:
        """Return how many items are in a state."""
        return sum(planned.state == state for planned in self.items)

    @property
    def to_build(self) -> Counter[str]:
        """Return how many items would be built, by the kind of their input."""
        return Counter(planned.kind for planned in self.items if planned.state == "to_build" and planned.kind)

    @property
    def cpu_s(self) -> float:
        """Estimate the CPU time (s) of what would be built."""
        return sum((number * self.rates[kind].cpu_s for kind, number in self.to_build.items()), 0.0)

    @property
    def cost_usd(self) -> float:
        """Estimate what services would charge for it (USD)."""
        return sum((number * self.usd_each[kind] for kind, number in self.to_build.items()), 0.0)


def plan_build(items: Iterable[Item], root: DatasetRoot, config: BuildConfig, remarks: list[str]) -> Plan:
    """Return what ``build`` would do for a data set: for all of its items, and new ones. It works on a copy of the ledger.

    ``remarks`` is filled while the items are read.
    """
    recipe, usd = TwinRecipe(config), estimate_usd(config)

    def record_of(twin_id: str) -> bytes | None:
        name = f"{recipe.folder_of(twin_id)}/{RECORD}"
        return root.read_bytes(name) if root.exists(name) else None

    with tempfile.TemporaryDirectory(prefix="manitwin-dry-run-") as scratch:
        copy = Path(scratch) / LEDGER
        copy_ledger(root, copy)
        ledger = Ledger(copy)
        try:
            given, _ = ledger.add_items(items)
            own = {kind: dataset_rate(ledger, kind, recipe.sha256) for kind in usd}
            ledger.begin_run(recipe.sha256, given)  # reopens items that a run would do again
            planned = _plan_items(ledger, _Planner(recipe, config, record_of, root))
            rates = {kind: own[kind] or measured_rate(config, kind, _photos_each(planned, kind)) for kind in usd}
            return Plan(planned, rates, usd, remarks)
        finally:
            ledger.close()


def _plan_items(ledger: Ledger, planner: _Planner) -> list[PlannedItem]:
    """Return a plan for each item: what has ended stays as the ledger has it, as in a run, and what is open is planned."""
    rows = ledger.connection.execute(
        "SELECT number, twin_id, kind, state, reason, detail FROM items ORDER BY number"
    ).fetchall()
    planner.seen.update(twin_id for _, twin_id, _, state, _, _ in rows if twin_id is not None and state != "open")
    planned = []
    for number, twin_id, kind, state, reason, detail in rows:
        item = Item.from_json(ledger.payload(number))
        if state == "open":
            planned.append(planner.plan(item))
            continue
        said = f"{reason}: {detail}" if state == "rejected" else detail
        planned.append(PlannedItem(item, twin_id, kind, state, said or ""))
    return planned


def _photos_each(items: Iterable[PlannedItem], kind: str) -> float:
    """Return how many photos the items of a kind that would be built have in the mean: 1 where they have none."""
    counts = [len(each.item.files) for each in items if each.kind == kind and each.state == "to_build"]
    return max(1.0, fmean(counts)) if counts else 1.0


def dataset_rate(ledger: Ledger, kind: str, recipe_sha256: str) -> Rate | None:
    """Return what accepted items of a kind took in this data set under the same recipe; None where they are too few."""
    number, total = ledger.connection.execute(
        "SELECT count(DISTINCT i.number), coalesce(sum(s.cpu_seconds), 0) FROM items i JOIN stages s ON s.number = i.number"
        " WHERE i.state = 'accepted' AND i.kind = ? AND i.recipe_sha256 = ?",
        (kind, recipe_sha256),
    ).fetchone()
    if number < ENOUGH_ITEMS:
        return None
    return Rate(total / number, f"the mean of {number} accepted items of this data set")


class _Planner:
    """Plans one input after the other; ``seen`` are the ids of twins that an earlier item makes."""

    def __init__(self, recipe: Recipe, config: BuildConfig, record_of: RecordOf, root: DatasetRoot):
        self._recipe, self._config, self._record_of, self._root = recipe, config, record_of, root
        self.seen: set[str] = set()

    def plan(self, item: Item) -> PlannedItem:
        found = inspect_identity(self._recipe, item, self._config.matting.frame)
        if isinstance(found, NotInspected):
            return PlannedItem(item, "", "", "would_be_rejected", str(found))
        identity, by_header = found
        twin_id, kind = identity.item_id, identity.kind
        if twin_id in self.seen:
            return PlannedItem(item, twin_id, kind, "duplicate", "the same input as an earlier one")
        self.seen.add(twin_id)
        record = self._record_of(twin_id)
        ending = None if record is None else self._ending_of(record, twin_id)
        if ending is not None:
            detail = f"{ending.reason}: {ending.detail}" if ending.reason else ending.detail
            return PlannedItem(item, twin_id, kind, ending.status, detail)
        refused = identity.rejected or by_header
        state: PlannedState = "to_build" if refused is None else "would_be_rejected"
        if refused is not None:
            return PlannedItem(item, twin_id, kind, state, str(refused))
        return PlannedItem(item, twin_id, kind, state, "" if record is None else self._rebuild_reason(record))

    def _ending_of(self, record: bytes, twin_id: str) -> Ending | None:
        try:
            return self._recipe.ending_of(record, self._amendments_digest(twin_id))
        except NewerVersion as error:
            raise NewerVersion(f"{self._root.url}/{self._recipe.folder_of(twin_id)}/{error}") from error

    def _rebuild_reason(self, record: bytes) -> str:
        """Return why a twin that is there would be built again."""
        try:
            otherwise = describe_differences(parse_record(record), self._config)
        except TwinError:
            return "the existing twin cannot be read"
        return f"the existing twin was made {otherwise or 'before its corrections by reviewers'}"

    def _amendments_digest(self, twin_id: str) -> str | None:
        return amendments_sha256(read_amendments(self._root, twin_id))
