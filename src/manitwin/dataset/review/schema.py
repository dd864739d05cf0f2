"""SQLite schema of the review store as numbered migrations; ``PRAGMA user_version`` counts those that a file has."""

from __future__ import annotations

import sqlite3

from manitwin.errors import UsageError
from manitwin.formats.schema_version import newer_schema_message

MIGRATIONS = (
    """
    CREATE TABLE events (
        number INTEGER PRIMARY KEY,
        kind TEXT NOT NULL CHECK (kind IN ('review', 'undo', 'sample')),
        annotator TEXT,
        twin_id TEXT,
        revision TEXT,
        undoes INTEGER UNIQUE REFERENCES events (number),
        request TEXT UNIQUE,                 -- the sender's own id: sent again, it is the same event
        at REAL NOT NULL,                    -- seconds since the epoch
        body TEXT NOT NULL                   -- JSON
    ) STRICT;
    CREATE INDEX events_by_twin ON events (twin_id, annotator);
    CREATE INDEX events_by_annotator ON events (annotator, kind);
    CREATE TRIGGER no_update BEFORE UPDATE ON events BEGIN SELECT RAISE (ABORT, 'events are only appended'); END;
    CREATE TRIGGER no_delete BEFORE DELETE ON events BEGIN SELECT RAISE (ABORT, 'events are only appended'); END;

    CREATE TABLE annotators (
        name TEXT PRIMARY KEY,
        at REAL NOT NULL
    ) STRICT, WITHOUT ROWID;

    CREATE TABLE drafts (
        annotator TEXT NOT NULL,
        twin_id TEXT NOT NULL,
        at REAL NOT NULL,
        body TEXT NOT NULL,
        PRIMARY KEY (annotator, twin_id)
    ) STRICT, WITHOUT ROWID;
    """,
    """
    CREATE TABLE successors (
        twin_id TEXT NOT NULL,
        before TEXT NOT NULL,                -- a revision
        after TEXT NOT NULL,                 -- one that differs from it by nothing that anybody judges
        at REAL NOT NULL,
        PRIMARY KEY (twin_id, before)
    ) STRICT, WITHOUT ROWID;
    """,
)


def migrate(connection: sqlite3.Connection, path: str) -> None:
    """Migrate a store to the newest schema; raises UsageError for a store of a newer version of this package."""
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version > len(MIGRATIONS):
        raise UsageError(newer_schema_message(path, version, len(MIGRATIONS)))
    for number, script in enumerate(MIGRATIONS[version:], version + 1):
        connection.executescript(f"BEGIN IMMEDIATE; {script}; PRAGMA user_version = {number}; COMMIT;")
