"""The end of a build, as a program and a person are told of it: from the ledger, and the records of the twins."""

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
    """The end of one item: its folder where it has one (and the data set is no URL), a line that says why, a rejection's code.

    ``unfinished`` has failed, or waits for a service; ``duplicate`` makes the twin that another item made. ``reused`` was
    there already. ``number`` is the item's in the ledger (``manitwin status --why``).
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
        """Return the result that a row of the ledger tells of."""
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
    """The end of a build: what became of the items that were given to it (of the whole data set, where none was given).

    ``run`` is the engine's own report; ``folders`` says what became of every file of a folder that was given. ``ended`` are the
    numbers of the items that ended in this build, ``found`` those of them whose folder was there already.
    """

    dataset: str
    run: RunReport
    folders: list[FolderListing] = field(default_factory=list)
    ended: frozenset[int] = frozenset()
    found: frozenset[int] = frozenset()

    @cached_property
    def results(self) -> list[ItemResult]:
        """The result of each item, in the order of their numbers; read from the ledger when it is first asked for."""
        return list(self.iterate())

    def iterate(self) -> Iterator[ItemResult]:
        """Yield the results one by one: 100,000 need not be in memory together."""
        root, given = DatasetRoot(self.dataset), frozenset(self.run.given)
        with read_ledger(local_ledger(root)) as ledger:
            for row in read_items(ledger):
                if not given or row.number in given:
                    yield ItemResult.of(row, root, row.number not in self.ended or row.number in self.found)

    def count(self, status: str) -> int:
        """Return how many items ended as 'accepted', 'rejected', 'unfinished' or 'duplicate'."""
        states = ("open", "failed") if status == "unfinished" else (status,)
        return sum(self.run.counts_of_given.get(state, 0) for state in states)

    def records(self) -> Iterator[TwinRecord]:
        """Read the records of the accepted twins, one after the other."""
        root = DatasetRoot(self.dataset)
        for result in self.iterate():
            if result.status == "accepted":
                name = f"{twin_name(result.twin_id)}/{RECORD}"
                yield parse_record(root.read_bytes(name), name)

    @property
    def remarks(self) -> list[str]:
        """Remarks on the inputs for the user, a line each."""
        return self.run.remarks

    @property
    def open(self) -> bool:
        """True where the same build again would go on; what failed is not tried again by itself (``manitwin retry``)."""
        return bool(self.run.stopped or self.run.left or self.run.counts_of_given.get("open"))

    @property
    def exit_code(self) -> int:
        """0 all accepted, 3 some rejected, 4 some unfinished: failed, or open and resumable."""
        return 4 if self.open or self.count("unfinished") else 3 if self.count("rejected") else 0
