"""Common parts of stores in a single SQLite file: transactions, and errors that name the file."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from manitwin.errors import UsageError
from manitwin.formats.printable import printable_line
from manitwin.formats.sqlite_schema import has_schema

BUSY_S = 30.0
"""How long a store waits for another process that writes to it."""
MOST_SAID = 120
"""Length limit of SQLite's message within an error message."""


@contextmanager
def transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """Commit the block's changes if it ends normally, and roll them back otherwise.

    The connection is in autocommit mode (``isolation_level=None``).
    """
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise


@contextmanager
def name_file_in_errors(path: Path, refusal: str) -> Iterator[None]:
    """Convert SQLite's errors in the block to UsageError naming the file; ``refusal`` is as for ``damaged``."""
    try:
        yield
    except sqlite3.OperationalError as error:
        said = printable_line(str(error), max_characters=MOST_SAID)
        raise UsageError(f"{path}: {said}; mend the disk or its permissions, and try again") from error
    except (sqlite3.DatabaseError, sqlite3.InterfaceError, UnicodeDecodeError) as error:
        raise damaged_file_error(path, error, refusal) from error


def damaged_file_error(path: Path, cause: object, refusal: str) -> UsageError:
    """Return the error of an unreadable file; ``refusal`` is its message, with {cause} in place of the cause."""
    return UsageError(f"{path}: {refusal.format(cause=printable_line(str(cause), max_characters=MOST_SAID))}")


def schema_flaw(
    connection: sqlite3.Connection, make: Callable[[sqlite3.Connection], object], *, tables_of: str
) -> str | None:
    """Return what is wrong with a database that should have the schema that ``make`` creates; None if nothing is."""
    if not has_schema(connection, make):
        return f"its tables do not match those of {tables_of}"
    (said,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    return None if said == "ok" else str(said)
