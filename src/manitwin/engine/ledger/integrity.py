"""Integrity checks of a ledger file: it must be a regular file and a sound database with the expected tables."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from manitwin.engine.ledger.migrations import migrate
from manitwin.errors import UsageError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.printable import printable_line

_OF_THE_DISK = frozenset(
    {sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED}
    | {sqlite3.SQLITE_NOMEM, sqlite3.SQLITE_INTERRUPT, sqlite3.SQLITE_CANTOPEN}
)
"""SQLite error codes that are not caused by the file's content."""

REMEDY = "run manitwin check DATASET, which moves it aside, then rerun the build with its inputs: it finds the finished twins"


class LedgerDamaged(UsageError):
    """A ledger that cannot be read. Its content can be rebuilt from the finished folders and the inputs."""


def ledger_damaged_error(path: Path, cause: object) -> LedgerDamaged:
    """Return the error for an unreadable ledger, as one line with its remedy."""
    said = printable_line(str(cause), max_characters=120)
    remedy = REMEDY.replace("DATASET", str(path.parent))
    return LedgerDamaged(f"{path}: not a readable ledger ({said}); {remedy}")


@contextmanager
def convert_sqlite_errors(path: Path) -> Iterator[None]:
    """Turn SQLite's errors on damaged files into LedgerDamaged, and errors of the disk into UsageError."""
    try:
        yield
    except sqlite3.DatabaseError as error:
        code = getattr(error, "sqlite_errorcode", None)
        if code is not None and code & 0xFF in _OF_THE_DISK:
            raise UsageError(f"{path}: {error}; check the disk and its permissions, and try again") from error
        raise ledger_damaged_error(path, error) from error
    except (UnicodeDecodeError, sqlite3.InterfaceError) as error:
        raise ledger_damaged_error(path, error) from error


def require_regular(path: Path) -> None:
    """Raise LedgerDamaged if a ledger, or a file that SQLite keeps beside it, is not a regular file or links out of its
    folder.
    """

    def refuse(line: str) -> LedgerDamaged:
        return ledger_damaged_error(path, line.split(";")[0])

    for each in (path, *wal_files(path)):
        if os.path.lexists(each):
            open_regular(each, refuse, inside=path.parent).close()


def wal_files(path: Path) -> tuple[Path, Path]:
    """Return the paths of the files that SQLite keeps beside a database in write-ahead mode."""
    return path.with_name(f"{path.name}-wal"), path.with_name(f"{path.name}-shm")


def check_integrity(connection: sqlite3.Connection, path: Path) -> None:
    """Raise LedgerDamaged if pages are damaged, or if the tables and columns of a migrated ledger differ from this version's."""
    (said,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if said != "ok":
        raise ledger_damaged_error(path, said)
    check_tables(connection, path)


def check_tables(connection: sqlite3.Connection, path: Path) -> None:
    """Raise LedgerDamaged if the database objects or columns differ from this version's; extra views and triggers count as
    well.
    """
    with closing(sqlite3.connect(":memory:")) as ours:
        migrate(ours, ":memory:")
        for what, of in (("tables", _objects), ("columns", _columns)):
            if of(connection) != of(ours):
                raise ledger_damaged_error(path, f"its {what} do not match those of a ledger")


def _objects(connection: sqlite3.Connection) -> set[tuple[str, str]]:
    rows = connection.execute("SELECT type, name FROM sqlite_master WHERE name NOT LIKE 'sqlite_%'")
    return {(kind, name) for kind, name in rows}


def _columns(connection: sqlite3.Connection) -> list[tuple[str, ...]]:
    rows = connection.execute(
        "SELECT t.name, c.name, c.type FROM sqlite_master t, pragma_table_info(t.name) c WHERE t.type = 'table'"
        " AND t.name NOT LIKE 'sqlite_%' ORDER BY 1, 2"
    )
    return [tuple(row) for row in rows]


def move_damaged_ledger(path: Path) -> Path:
    """Rename a damaged ledger and delete SQLite's files beside it; return the new path."""
    place, number = path.with_name(f"{path.name}.damaged"), 1
    while os.path.lexists(place):
        number += 1
        place = path.with_name(f"{path.name}.damaged.{number}")
    for each in wal_files(path):
        if os.path.lexists(each):  # useless without the ledger, and would be taken for the next ledger's
            os.unlink(each)
    os.rename(path, place)
    return place
