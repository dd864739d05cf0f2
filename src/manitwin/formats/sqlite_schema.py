"""Is the schema of an SQLite file ours? A file of others may have views and triggers that run without an end."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing

_OBJECTS = "SELECT type, name, tbl_name, sql FROM sqlite_schema WHERE name NOT LIKE 'sqlite\\_%' ESCAPE '\\'"


def has_schema(connection: sqlite3.Connection, make: Callable[[sqlite3.Connection], object]) -> bool:
    """Tell whether a database has the tables, indices and triggers that ``make`` gives an empty one, word for word, and no more.

    A view in a table's place is run by the first SELECT: one with a recursive query that does not end would hang its reader.
    """
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as ours:
        make(ours)
        return set(connection.execute(_OBJECTS)) == set(ours.execute(_OBJECTS))
