"""The list of the files that make up an index: ``index/parts.json``, replaced whole, so that an index changes at one moment."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field

from manitwin.dataset.index.tables import SCHEMA_ID, TABLES
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import canonical_json

INDEX = "index"
PARTS = f"{INDEX}/parts.json"


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
    try:
        content = root.read_bytes(PARTS)
    except FileNotFoundError:
        return None
    try:
        data = json.loads(content)
        parts = tuple(IndexPart(**part) for part in data["parts"])
        found = PartList(parts, data["next"], data["schema_id"])
    except (ValueError, KeyError, TypeError) as error:
        raise UsageError(f"{root.full(PARTS)}: cannot be read ({error}); run manitwin index {root.url}") from error
    if found.schema_id != SCHEMA_ID:
        raise UsageError(
            f"{root.full(PARTS)}: its tables are of another version of manitwin; run manitwin index {root.url}"
        )
    return found


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
