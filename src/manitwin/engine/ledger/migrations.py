"""The ledger's schema as numbered migrations; ``PRAGMA user_version`` counts those applied to a file."""

from __future__ import annotations

import sqlite3

from manitwin.errors import UsageError
from manitwin.formats.schema_version import is_newer, newer_schema_message

MIGRATIONS = (
    """
    CREATE TABLE items (
        number INTEGER PRIMARY KEY,
        item TEXT NOT NULL UNIQUE,           -- the payload of its task, JSON
        twin_id TEXT,                        -- known once its bytes were read
        kind TEXT,
        state TEXT NOT NULL DEFAULT 'open',  -- open, accepted, rejected, failed, duplicate
        reason TEXT,                         -- code of a rejection, or what failed
        detail TEXT NOT NULL DEFAULT '',
        recipe_sha256 TEXT,                  -- under which configuration and stages it ended
        revision TEXT,
        indexed INTEGER NOT NULL DEFAULT 0,
        ended_at REAL
    ) STRICT;
    CREATE INDEX items_by_state ON items (state, number);
    CREATE UNIQUE INDEX items_by_twin ON items (twin_id) WHERE state <> 'duplicate';

    CREATE TABLE stages (
        number INTEGER NOT NULL REFERENCES items (number),
        stage TEXT NOT NULL,
        key TEXT,
        state TEXT NOT NULL,                 -- running, done, rejected, waiting, failed
        attempts INTEGER NOT NULL DEFAULT 0,
        runs INTEGER NOT NULL DEFAULT 0,     -- how often it came to an end: more than once only where its key changed
        seconds REAL NOT NULL DEFAULT 0,
        cpu_seconds REAL NOT NULL DEFAULT 0,
        cost_usd REAL NOT NULL DEFAULT 0,
        error TEXT,
        at REAL NOT NULL,
        PRIMARY KEY (number, stage)
    ) STRICT, WITHOUT ROWID;
    CREATE INDEX stages_by_state ON stages (stage, state);

    CREATE TABLE runs (
        run INTEGER PRIMARY KEY,
        started_at REAL NOT NULL,
        ended_at REAL,
        recipe_sha256 TEXT NOT NULL,
        ended_how TEXT
    ) STRICT;
    """,
)


def schema_of(connection: sqlite3.Connection, path: str) -> int:
    """Return how many migrations a ledger has had. Raises UsageError for a ledger of a newer version of this package."""
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if is_newer(version, len(MIGRATIONS)):
        raise UsageError(newer_schema_message(path, version, len(MIGRATIONS)))
    return int(version)


def migrate(connection: sqlite3.Connection, path: str) -> None:
    """Migrate a ledger to the latest schema. Raises UsageError for a ledger of a newer version of this package."""
    version = schema_of(connection, path)
    for number, script in enumerate(MIGRATIONS[version:], version + 1):
        connection.executescript(f"BEGIN; {script}; PRAGMA user_version = {number}; COMMIT;")
