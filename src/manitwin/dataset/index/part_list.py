"""The list of the files that make up an index: ``index/parts.json``, replaced whole, so that an index changes at one moment."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from manitwin.dataset.index.tables import SCHEMA_ID, TABLES
from manitwin.engine.ledger.ledger import LEDGER
from manitwin.errors import UsageError
from manitwin.formats.bounded_file import Refusal, open_regular, with_remedy
from manitwin.formats.parquet_file import check_parquet
from manitwin.formats.printable import printable_line
from manitwin.twin.dataset_root import TWINS, DatasetRoot
from manitwin.twin.store import canonical_json

INDEX = "index"
PARTS = f"{INDEX}/parts.json"
MAX_ROWS = 1 << 40
"""Of a table, and of its files: they are read a row group at a time."""


@dataclass(frozen=True)
class IndexPart:
    """Rows of some twins, in one file a table.

    ``rows`` are those of each table. All ids lie between ``first`` and ``last``, which other parts may overlap; which they
    are stands in the columns ``twin_id`` of ``twins`` and ``rejections``.
    """

    name: str
    rows: dict[str, int]
    first: str
    last: str

    def file(self, table: str) -> str:
        """Return the name of a table's file below the data set's root."""
        return f"{INDEX}/{table}/{self.name}.parquet"

    @property
    def twins(self) -> int:
        """The number of its twins, accepted and rejected."""
        return self.rows["twins"] + self.rows["rejections"]


@dataclass(frozen=True)
class PartList:
    """The parts that count, by their first id; ``next`` numbers the next one: no name is used twice."""

    parts: tuple[IndexPart, ...] = ()
    next: int = 0
    schema_id: str = field(default=SCHEMA_ID)

    def rows(self, table: str) -> int:
        """Return how many rows a table has."""
        return sum(part.rows[table] for part in self.parts)

    def write(self, root: DatasetRoot) -> None:
        """Replace the list of a data set: from here on its index is this one."""
        root.write_bytes(PARTS, canonical_json(asdict(self)).encode())


def read_part_list(root: DatasetRoot) -> PartList | None:
    """Return the parts of a data set's index, or None where it has no index.

    Raises UsageError for an index of other tables than this version's.
    """
    remedy = remedy_of(root)
    try:
        data = root.read_json(PARTS, refusal_of(root))
    except FileNotFoundError:
        return None
    try:
        parts = tuple(_part(said) for said in data["parts"])
        found = PartList(parts, _count(data["next"]), data["schema_id"])
    except (ValueError, KeyError, TypeError) as error:
        said = printable_line(str(error), max_characters=120)
        raise UsageError(f"{root.full(PARTS)}: not a list of index parts ({said}); {remedy}") from error
    if found.schema_id != SCHEMA_ID:
        raise UsageError(
            f"{root.full(PARTS)}: its tables were written by another version of manitwin; run manitwin index {root.url}"
        )
    return found


def no_index(root: DatasetRoot) -> UsageError:
    """Return the error of a place without an index: it can be made where there are twins, and only there."""
    if not root.has_twins:
        return no_dataset(root)
    return UsageError(f"{root.url}: has no index; run manitwin index {root.url}")


def no_dataset(root: DatasetRoot) -> UsageError:
    """Return the error of a place without twins: of a build that has not ended one yet, or of no build."""
    if root.exists(LEDGER):
        return UsageError(f"{root.url}: no twin is finished yet; manitwin status {root.url} shows the progress")
    return UsageError(
        f"{root.url}: not a data set ({TWINS}/ is missing); give the folder or URL that manitwin build wrote"
    )


def remedy_of(root: DatasetRoot) -> str:
    """Return what mends a damaged index."""
    return f"run manitwin check {root.url}"


def refusal_of(root: DatasetRoot) -> Refusal:
    """Return what makes the error of a file that is none: its own remedy gives way to that of an index."""
    return with_remedy(UsageError, remedy_of(root))


def require_files(root: DatasetRoot, parts: PartList) -> None:
    """Raise UsageError where a part's file is none that can be read whole; those of a URL are left to who reads them."""
    if root.local is None:
        return
    for part in parts.parts:
        for table, schema in TABLES.items():
            path = Path(root.full(part.file(table)))
            if part.rows[table] or os.path.lexists(path):
                rows = check_parquet(
                    path, refusal_of(root), schema=schema, remedy=remedy_of(root), inside=root.local, max_rows=MAX_ROWS
                )
                if rows != part.rows[table]:
                    raise UsageError(f"{path}: {rows} rows, {PARTS} says {part.rows[table]}; {remedy_of(root)}")


def require_regular(root: DatasetRoot, parts: PartList) -> None:
    """Raise UsageError where a part's file is no regular one below the root; one that has gone is left to who reads it."""
    for part in parts.parts if root.local is not None else ():
        for table in TABLES:
            path = Path(root.full(part.file(table)))
            if os.path.lexists(path):
                open_regular(path, refusal_of(root), inside=root.local, name=str(path)).close()


def _part(said: Any) -> IndexPart:
    part = IndexPart(**said)
    texts = all(isinstance(each, str) for each in (part.name, part.first, part.last))
    if not texts or not part.name.isdecimal() or not part.name.isascii() or not isinstance(part.rows, dict):
        raise ValueError(f"a part {str(part.name)[:40]!r}")
    if part.rows.keys() != TABLES.keys():
        raise ValueError(f"part {part.name} has not the rows of all tables")
    return replace(part, rows={table: _count(rows) for table, rows in part.rows.items()})


def _count(said: Any) -> int:
    if type(said) is not int or not 0 <= said <= MAX_ROWS:
        raise ValueError(f"{str(said)[:40]!r} is no count")
    return said


def in_order_of_twins(parts: Iterable[IndexPart]) -> tuple[IndexPart, ...]:
    """Return parts as the list keeps them."""
    return tuple(sorted(parts, key=lambda part: (part.first, part.last, part.name)))


def sweep(root: DatasetRoot, keep: PartList) -> list[str]:
    """Remove the files of the index that are in no part: what a crash left, and what has been replaced. Returns their names."""
    wanted = {PARTS, *(part.file(table) for part in keep.parts for table in TABLES)}
    stale = [name for name in root.names_below(INDEX) if name not in wanted]
    for name in stale:
        root.remove(name)
    return stale
