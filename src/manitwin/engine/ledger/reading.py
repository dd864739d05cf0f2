"""Open a ledger for reading alone, also while a run writes it."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from manitwin.engine.ledger.lock import is_written
from manitwin.engine.ledger.migrations import schema_of
from manitwin.engine.ledger.soundness import check_whole, require_regular, sound
from manitwin.errors import UsageError


@contextmanager
def read_ledger(path: Path) -> Iterator[sqlite3.Connection]:
    """Open a ledger for reading, also while a run writes it; raises UsageError where there is none, a damaged one, or one of
    a newer version of this package.

    Nothing is left beside one that no run writes: SQLite's reader of a write-ahead log makes files there and does not remove
    them, so where that log holds nothing it is told to leave it alone (https://sqlite.org/uri.html, ``immutable``). What
    watches a ledger opens it anew each time: a run that begins meanwhile is not seen through such a connection.
    """
    if not os.path.lexists(path):
        raise UsageError(f"{path}: no ledger found; `manitwin build INPUT... -o DATASET` creates one")
    require_regular(path)
    log = path.with_name(f"{path.name}-wal")
    at_rest = not is_written(path) and (not log.is_file() or log.stat().st_size == 0)
    connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro{'&immutable=1' if at_rest else ''}", uri=True)
    connection.row_factory = sqlite3.Row
    try:
        with sound(path):
            connection.execute("PRAGMA trusted_schema = OFF")
            # first: tables of a newer one are no damage, and nothing is to be put aside
            schema_of(connection, str(path))
            check_whole(connection, path)
            yield connection
    finally:
        connection.close()
