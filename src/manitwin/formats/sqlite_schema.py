"""Check of an SQLite schema: an untrusted file may have views and triggers that never end."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing

_OBJECTS = "SELECT type, name, tbl_name, sql FROM sqlite_schema WHERE name NOT LIKE 'sqlite\\_%' ESCAPE '\\'"


def has_schema(connection: sqlite3.Connection, make: Callable[[sqlite3.Connection], object]) -> bool:
    """Return whether a database has exactly the tables, indices and triggers that ``make`` creates in an empty one.

    The first SELECT executes a view in place of a table: an endless recursive query in it would hang the reader.
    """
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as ours:
        make(ours)
        return set(connection.execute(_OBJECTS)) == set(ours.execute(_OBJECTS))
