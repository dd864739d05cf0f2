"""The report on a build, from the ledger and the records of the twins."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Literal, cast

from manitwin.engine.drive import RunReport
from manitwin.engine.ledger.location import local_ledger
from manitwin.engine.ledger.progress import read_items
from manitwin.engine.ledger.reading import read_ledger
from manitwin.engine.ledger.rows import ItemRow
from manitwin.pipeline.folder_listing import FolderListing
from manitwin.pipeline.item import Item
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import RECORD, parse_record

ItemStatus = Literal["accepted", "rejected", "unfinished", "duplicate"]


@dataclass(frozen=True)
class ItemResult:
    """The result of one item: its folder if it has one (and the data set is local), a message, and the reason code of a
    rejection.

    ``unfinished`` items have failed or wait for a service; a ``duplicate`` gives the same twin as another item. ``reused``: the
    result existed already. ``number`` is the item's number in the ledger (``manitwin status --why``).
    """

    number: int
    item: Item
    twin_id: str
    status: ItemStatus
    detail: str
    folder: Path | None
    reused: bool = False
    reason: str | None = None

    @classmethod
    def of(cls, row: ItemRow, root: DatasetRoot, reused: bool) -> ItemResult:
        """Return the result described by a row of the ledger."""
        ended = row.state in ("accepted", "rejected")
        return cls(
            number=row.number,
            item=Item.from_json(row.payload),
            twin_id=row.item_id,
            status=cast(ItemStatus, "unfinished" if row.state in ("open", "failed") else row.state),
            detail=f"{row.reason}: {row.detail}" if row.state == "rejected" else row.detail,
            folder=root.local / twin_name(row.item_id) if root.local is not None and ended else None,
            reused=reused and ended,
            reason=row.reason if row.state == "rejected" else None,
        )


@dataclass(frozen=True)
class BuildReport:
    """The results of a build for the given items (for the whole data set if none was given).

    ``run`` is the engine's report; ``folders`` classifies every file of the given folders. ``ended`` are the numbers of the
    items that ended in this build, ``found`` those of them whose folder existed already.
    """

    dataset: str
    run: RunReport
    folders: list[FolderListing] = field(default_factory=list)
    ended: frozenset[int] = frozenset()
    found: frozenset[int] = frozenset()

    @cached_property
    def results(self) -> list[ItemResult]:
        """The result of each item by number; read from the ledger on first access."""
        return list(self.iterate())

    def iterate(self) -> Iterator[ItemResult]:
        """Yield the results one at a time, without keeping all of them in memory."""
        root, given = DatasetRoot(self.dataset), frozenset(self.run.given)
        with read_ledger(local_ledger(root)) as ledger:
            for row in read_items(ledger):
                if not given or row.number in given:
                    yield ItemResult.of(row, root, row.number not in self.ended or row.number in self.found)

    def count(self, status: str) -> int:
        """Return the number of items that ended as 'accepted', 'rejected', 'unfinished' or 'duplicate'."""
        states = ("open", "failed") if status == "unfinished" else (status,)
        return sum(self.run.counts_of_given.get(state, 0) for state in states)

    def records(self) -> Iterator[TwinRecord]:
        """Yield the records of the accepted twins."""
        root = DatasetRoot(self.dataset)
        for result in self.iterate():
            if result.status == "accepted":
                name = f"{twin_name(result.twin_id)}/{RECORD}"
                yield parse_record(root.read_bytes(name), name)

    @property
    def remarks(self) -> list[str]:
        """Remarks on the inputs, one line each."""
        return self.run.remarks

    @property
    def open(self) -> bool:
        """True if repeating the build would continue it; failed items are not retried automatically (``manitwin retry``)."""
        return bool(self.run.stopped or self.run.left or self.run.counts_of_given.get("open"))

    @property
    def exit_code(self) -> int:
        """Exit status: 0 all accepted, 3 some rejected, 4 some unfinished (failed, or open and resumable)."""
        return 4 if self.open or self.count("unfinished") else 3 if self.count("rejected") else 0
