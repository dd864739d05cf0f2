"""Open a ledger read-only, also while a run writes it."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from manitwin.engine.ledger.integrity import check_integrity, convert_sqlite_errors, require_regular
from manitwin.engine.ledger.lock import is_written
from manitwin.engine.ledger.migrations import schema_of
from manitwin.errors import UsageError


@contextmanager
def read_ledger(path: Path) -> Iterator[sqlite3.Connection]:
    """Open a ledger read-only, also while a run writes it.

    Raises UsageError if there is none, or if it was written by a newer version of this package, and LedgerDamaged if it is
    damaged.

    A ledger that no run writes is opened without leaving files behind: SQLite's reader of a write-ahead log creates files
    beside the database, so the log is bypassed if it is empty (https://sqlite.org/uri.html, ``immutable``). To watch a ledger,
    open it anew each time: such a connection does not see the changes of a run that starts later.
    """
    if not os.path.lexists(path):
        raise UsageError(f"{path}: no ledger found; `manitwin build INPUT... -o DATASET` creates one")
    require_regular(path)
    log = path.with_name(f"{path.name}-wal")
    at_rest = not is_written(path) and (not log.is_file() or log.stat().st_size == 0)
    connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro{'&immutable=1' if at_rest else ''}", uri=True)
    connection.row_factory = sqlite3.Row
    try:
        with convert_sqlite_errors(path):
            connection.execute("PRAGMA trusted_schema = OFF")
            # checked first: tables of a newer version are not damage
            schema_of(connection, str(path))
            check_integrity(connection, path)
            yield connection
    finally:
        connection.close()
