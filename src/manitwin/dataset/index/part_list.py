"""List of the files that make up an index: ``index/parts.json``, replaced atomically, so that an index changes at one instant."""

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
"""Maximum number of rows of a table and of each of its files, which are read one row group at a time."""


@dataclass(frozen=True)
class IndexPart:
    """The rows of some twins, one file per table.

    ``rows`` is the number of rows per table. All twin ids lie between ``first`` and ``last``; the ranges of parts may overlap.
    The columns ``twin_id`` of ``twins`` and ``rejections`` say which ids a part has.
    """

    name: str
    rows: dict[str, int]
    first: str
    last: str

    def file(self, table: str) -> str:
        """Return the name of a table's file, relative to the data set's root."""
        return f"{INDEX}/{table}/{self.name}.parquet"

    @property
    def twins(self) -> int:
        """The number of twins, accepted and rejected."""
        return self.rows["twins"] + self.rows["rejections"]


@dataclass(frozen=True)
class PartList:
    """The valid parts, sorted by first id. ``next`` is the number of the next part; part names are never reused."""

    parts: tuple[IndexPart, ...] = ()
    next: int = 0
    schema_id: str = field(default=SCHEMA_ID)

    def rows(self, table: str) -> int:
        """Return the number of rows of a table."""
        return sum(part.rows[table] for part in self.parts)

    def write(self, root: DatasetRoot) -> None:
        """Replace the list of a data set, which makes this index the valid one."""
        root.write_bytes(PARTS, canonical_json(asdict(self)).encode())


def read_part_list(root: DatasetRoot) -> PartList | None:
    """Return the parts of a data set's index, or None if it has no index.

    Raises UsageError if the index is unreadable or has the tables of another version.
    """
    remedy = repair_command(root)
    try:
        data = root.read_json(PARTS, error_factory(root))
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
    """Return the error for a place without an index; it suggests ``manitwin index`` only if the place has twins."""
    if not root.has_twins:
        return no_dataset(root)
    return UsageError(f"{root.url}: has no index; run manitwin index {root.url}")


def no_dataset(root: DatasetRoot) -> UsageError:
    """Return the error for a place without twins, either a build that has not finished any or a place that is no data set."""
    if root.exists(LEDGER):
        return UsageError(f"{root.url}: no twin is finished yet; manitwin status {root.url} shows the progress")
    return UsageError(
        f"{root.url}: not a data set ({TWINS}/ is missing); give the folder or URL that manitwin build wrote"
    )


def repair_command(root: DatasetRoot) -> str:
    """Return the command that repairs a damaged index."""
    return f"run manitwin check {root.url}"


def error_factory(root: DatasetRoot) -> Refusal:
    """Return a factory of errors for malformed files whose own remedy is replaced by that of the index."""
    return with_remedy(UsageError, repair_command(root))


def require_files(root: DatasetRoot, parts: PartList) -> None:
    """Raise UsageError if a part's file cannot be read completely. Files at a URL are left to their reader."""
    if root.local is None:
        return
    for part in parts.parts:
        for table, schema in TABLES.items():
            path = Path(root.full(part.file(table)))
            if part.rows[table] or os.path.lexists(path):
                rows = check_parquet(
                    path,
                    error_factory(root),
                    schema=schema,
                    remedy=repair_command(root),
                    inside=root.local,
                    max_rows=MAX_ROWS,
                )
                if rows != part.rows[table]:
                    raise UsageError(f"{path}: {rows} rows, {PARTS} says {part.rows[table]}; {repair_command(root)}")


def require_regular(root: DatasetRoot, parts: PartList) -> None:
    """Raise UsageError if a part's file is not a regular file below the root. Missing files are left to their reader."""
    for part in parts.parts if root.local is not None else ():
        for table in TABLES:
            path = Path(root.full(part.file(table)))
            if os.path.lexists(path):
                open_regular(path, error_factory(root), inside=root.local, name=str(path)).close()


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


def sort_parts(parts: Iterable[IndexPart]) -> tuple[IndexPart, ...]:
    """Return parts in the order of the list."""
    return tuple(sorted(parts, key=lambda part: (part.first, part.last, part.name)))


def remove_unused_files(root: DatasetRoot, keep: PartList) -> list[str]:
    """Remove index files that belong to no part (left by a crash, or replaced) and return their names."""
    wanted = {PARTS, *(part.file(table) for part in keep.parts for table in TABLES)}
    stale = [name for name in root.names_below(INDEX) if name not in wanted]
    for name in stale:
        root.remove(name)
    return stale
