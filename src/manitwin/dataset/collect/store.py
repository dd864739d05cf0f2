"""Catalogue storage: one SQLite file with one row per input place. Committed rows are durable."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from manitwin.dataset.collect.facts import BANDS, GROUPS, UNKNOWN
from manitwin.dataset.collect.schema import APPLICATION, MIGRATIONS, migrate
from manitwin.errors import UsageError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.schema_version import newer_schema_message
from manitwin.formats.sqlite_store import BUSY_S, damaged_file_error, name_file_in_errors, schema_flaw, transaction

Kind = Literal["image", "mesh", "asset", "url"]
Status = Literal["ready", "listed", "duplicate", "unreadable"]
_DAMAGED = "is not a readable catalogue ({cause}); give another"
COUNTED = ("group", "status", "licence", "source", "size_band")
"""Columns by which rows are counted."""


@dataclass(frozen=True)
class Row:
    """One input. ``status`` is ready (the file was read), listed (a URL), duplicate, or unreadable with a ``cause``."""

    place: str
    kind: Kind
    source: str
    licence: str
    attribution: str | None
    name: str | None
    category: str
    grp: str
    size_m: float | None
    size_source: str | None
    size_band: str
    sha256: str | None
    bytes: int | None
    modified_ns: int | None
    status: Status
    cause: str | None


@dataclass(frozen=True)
class Refused:
    """Number of entries of a list that became no row for one cause, with the first as an example."""

    list: str
    cause: str
    count: int
    example: str


_COLUMNS = tuple(Row.__dataclass_fields__)
_UPSERT = (
    f"INSERT INTO inputs ({', '.join(_COLUMNS)}) VALUES ({', '.join(f':{name}' for name in _COLUMNS)})"
    f" ON CONFLICT (place) DO UPDATE SET {', '.join(f'{name} = excluded.{name}' for name in _COLUMNS)}, duplicate_of = NULL"
)


_MARK_ALIKE = (
    "UPDATE inputs SET status = 'duplicate', duplicate_of ="
    " (SELECT min(number) FROM inputs AS other JOIN looks ON looks.alike = other.sha256 WHERE looks.sha256 = inputs.sha256)"
    " WHERE status = 'ready' AND sha256 IN (SELECT looks.sha256 FROM looks JOIN inputs AS other ON other.sha256 = alike)"
)
"""Marks an input as a duplicate of the earlier input that it looks like, as long as that input exists."""


class Catalogue:
    """An open catalogue. Raises UsageError if the file is missing and ``make`` is False, or is not a catalogue."""

    def __init__(self, path: Path, *, make: bool = False):
        self.path = path
        if not make and not os.path.lexists(path):
            raise UsageError(
                f"{path}: this catalogue does not exist; `manitwin collect add {path} FOLDER --source NAME` creates one"
            )
        fresh = not os.path.lexists(path)
        if not fresh:
            with open_regular(path, UsageError, name=str(path)) as stream:
                fresh = os.fstat(stream.fileno()).st_size == 0
        with self._sqlite_errors():
            self._connection = sqlite3.connect(path, isolation_level=None, timeout=BUSY_S)
            try:
                self._open(fresh and make)
            except BaseException:
                self._connection.close()
                raise

    def _open(self, fresh: bool) -> None:
        run = self._connection.execute
        run("PRAGMA trusted_schema = OFF")
        if fresh:
            run(f"PRAGMA application_id = {APPLICATION}")
        (application,), (version,) = run("PRAGMA application_id").fetchone(), run("PRAGMA user_version").fetchone()
        if application != APPLICATION:
            raise UsageError(
                f"{self.path}: is not a catalogue; give one that `manitwin collect add` made, or a new name"
            )
        if version > len(MIGRATIONS):
            raise UsageError(newer_schema_message(self.path, version, len(MIGRATIONS)))
        migrate(self._connection, version)
        if (flaw := schema_flaw(self._connection, migrate, tables_of="a catalogue")) is not None:
            raise damaged_file_error(self.path, flaw, _DAMAGED)

    def __enter__(self) -> Catalogue:
        return self

    def __exit__(self, *_: object) -> None:
        self._connection.close()

    def known(self, places: Iterable[str]) -> dict[str, Row]:
        """Return the existing rows of some places, keyed by place; duplicates are returned as ready."""
        found = {}
        for place in places:
            with self._sqlite_errors():
                row = self._connection.execute(
                    f"SELECT {', '.join(_COLUMNS)} FROM inputs WHERE place = ?", (place,)
                ).fetchone()
            if row is not None:
                said = dict(zip(_COLUMNS, row, strict=True))
                found[place] = Row(**{**said, "status": "ready" if said["status"] == "duplicate" else said["status"]})
        return found

    def put(self, rows: Iterable[Row]) -> None:
        """Insert or update rows in one transaction. The row of a known place keeps its number."""
        with self._writing() as connection:
            connection.executemany(_UPSERT, [asdict(row) for row in rows])

    def finish(self, list_: str, refused: Iterable[Refused]) -> None:
        """Replace the refusals of a list, and mark files with equal bytes.

        Of equal files the first stays ready; the others become duplicates that refer to it.
        """
        with self._writing() as connection:
            connection.execute("DELETE FROM refused WHERE list = ?", (list_,))
            connection.executemany(
                "INSERT INTO refused VALUES (?, ?, ?, ?)", [(r.list, r.cause, r.count, r.example) for r in refused]
            )
            connection.execute(
                "UPDATE inputs SET status = 'ready', duplicate_of = NULL WHERE status = 'duplicate' AND number ="
                " (SELECT min(number) FROM inputs AS same WHERE same.sha256 = inputs.sha256)"
            )
            connection.execute(
                "UPDATE inputs SET status = 'duplicate', duplicate_of = first FROM"
                " (SELECT sha256 AS digest, min(number) AS first FROM inputs WHERE sha256 IS NOT NULL"
                " GROUP BY sha256 HAVING count(*) > 1)"
                " WHERE sha256 = digest AND number > first AND duplicate_of IS NOT first"
            )
            connection.execute(_MARK_ALIKE)

    def files_without_feature(self, version: int) -> list[tuple[str, str, str]]:
        """Return digest, place and kind of each ready file without a vector of this version, in catalogue order."""
        with self._sqlite_errors():
            return self._connection.execute(
                "SELECT sha256, place, kind FROM inputs WHERE status = 'ready' AND sha256 IS NOT NULL AND NOT EXISTS"
                " (SELECT 1 FROM looks WHERE looks.sha256 = inputs.sha256 AND version = ?) ORDER BY number",
                (version,),
            ).fetchall()

    def put_features(self, version: int, looks: Iterable[tuple[str, bytes | None]]) -> None:
        """Store the vectors of files by their digests."""
        with self._writing() as connection:
            connection.executemany(
                "INSERT OR REPLACE INTO looks VALUES (?, ?, ?, NULL)",
                [(digest, version, look) for digest, look in looks],
            )

    def features(self, version: int) -> list[tuple[str, str, bytes]]:
        """Return digest, kind and vector of each file that has one, in catalogue order, one per distinct content."""
        with self._sqlite_errors():
            return self._connection.execute(
                "SELECT inputs.sha256, kind, look FROM inputs JOIN looks USING (sha256) WHERE version = ? AND look IS NOT NULL"
                " AND number = (SELECT min(number) FROM inputs AS same WHERE same.sha256 = inputs.sha256) ORDER BY number",
                (version,),
            ).fetchall()

    def put_near_duplicates(self, alike: Mapping[str, str]) -> None:
        """Replace the near-duplicate relations (digest to digest of the earlier file) and mark the duplicates."""
        with self._writing() as connection:
            connection.execute(
                "UPDATE inputs SET status = 'ready', duplicate_of = NULL WHERE status = 'duplicate' AND number ="
                " (SELECT min(number) FROM inputs AS same WHERE same.sha256 = inputs.sha256)"
            )
            connection.execute("UPDATE looks SET alike = NULL WHERE alike IS NOT NULL")
            connection.executemany(
                "UPDATE looks SET alike = ? WHERE sha256 = ?", [(of, key) for key, of in alike.items()]
            )
            connection.execute(_MARK_ALIKE)

    def ready(self) -> Iterator[Row]:
        """Yield the usable rows, including URLs, in catalogue order."""
        with self._sqlite_errors():
            cursor = self._connection.execute(
                f"SELECT {', '.join(_COLUMNS)} FROM inputs WHERE status IN ('ready', 'listed') ORDER BY number"
            )
            for values in cursor:
                row = Row(*values)
                self._require_known(row.grp, row.size_band)
                yield row

    def counts(self) -> list[tuple[tuple[str, ...], int]]:
        """Return the number of rows per combination of values of ``COUNTED``."""
        with self._sqlite_errors():
            rows = self._connection.execute(
                "SELECT grp, status, licence, source, size_band, count(*) FROM inputs GROUP BY 1, 2, 3, 4, 5"
            ).fetchall()
        for grp, *_, size_band, _count in rows:
            self._require_known(grp, size_band)
        return [(row[:-1], row[-1]) for row in rows]

    def _require_known(self, group: str, band: str) -> None:
        if group not in (*GROUPS, UNKNOWN) or band not in BANDS:
            raise damaged_file_error(self.path, f"a row of group {group!r} and size {band!r}", _DAMAGED)

    def unreadable_counts(self) -> dict[str, int]:
        """Return the number of unreadable rows by cause."""
        return self._pairs(
            "SELECT cause, count(*) FROM inputs WHERE status = 'unreadable' GROUP BY 1 ORDER BY 2 DESC, 1"
        )

    def refused(self) -> list[Refused]:
        """Return the refused entries by list and cause."""
        with self._sqlite_errors():
            rows = self._connection.execute("SELECT * FROM refused ORDER BY list, count DESC, cause").fetchall()
        return [Refused(*row) for row in rows]

    def _pairs(self, sql: str) -> dict[str, int]:
        with self._sqlite_errors():
            return dict(self._connection.execute(sql).fetchall())

    @contextmanager
    def _writing(self) -> Iterator[sqlite3.Connection]:
        with self._sqlite_errors(), transaction(self._connection):
            yield self._connection

    def _sqlite_errors(self) -> AbstractContextManager[None]:
        return name_file_in_errors(self.path, _DAMAGED)


def counts_by_column(counts: Iterable[tuple[tuple[str, ...], int]]) -> Mapping[str, dict[str, int]]:
    """Return the number of rows per value of each column of ``COUNTED``."""
    found: dict[str, dict[str, Any]] = {name: {} for name in COUNTED}
    for values, count in counts:
        for name, value in zip(COUNTED, values, strict=True):
            found[name][value] = found[name].get(value, 0) + count
    return found
