"""SQLite schema of a catalogue as numbered migrations; ``PRAGMA user_version`` counts those that a file has."""

from __future__ import annotations

import sqlite3

APPLICATION = 0x4D54434C
"""``PRAGMA application_id`` that identifies a catalogue among SQLite files: the letters MTCL."""

MIGRATIONS = (
    """
    CREATE TABLE inputs (
        number INTEGER PRIMARY KEY,          -- in the order in which they came
        place TEXT NOT NULL UNIQUE,          -- absolute path, or URL
        kind TEXT NOT NULL CHECK (kind IN ('image', 'mesh', 'asset', 'url')),
        source TEXT NOT NULL,
        licence TEXT NOT NULL,               -- SPDX, or 'unknown'
        attribution TEXT,
        name TEXT,                           -- as it was given
        category TEXT NOT NULL,              -- of the priors, or 'unknown'
        grp TEXT NOT NULL,
        size_m REAL,                         -- longest axis
        size_source TEXT,
        size_band TEXT NOT NULL,
        sha256 TEXT,
        bytes INTEGER,
        modified_ns INTEGER,
        status TEXT NOT NULL CHECK (status IN ('ready', 'listed', 'duplicate', 'unreadable')),
        cause TEXT,                          -- why it is unreadable
        duplicate_of INTEGER REFERENCES inputs (number)
    ) STRICT;
    CREATE INDEX inputs_by_counted ON inputs (grp, status, licence, source, size_band);
    CREATE INDEX inputs_by_digest ON inputs (sha256, number) WHERE sha256 IS NOT NULL;

    CREATE TABLE refused (
        list TEXT NOT NULL,                  -- absolute path of what was added
        cause TEXT NOT NULL,
        count INTEGER NOT NULL,
        example TEXT NOT NULL,               -- the first: a line, or a file
        PRIMARY KEY (list, cause)
    ) STRICT, WITHOUT ROWID;
    """,
    """
    CREATE TABLE looks (
        sha256 TEXT PRIMARY KEY,             -- of the file
        version INTEGER NOT NULL,
        look BLOB,                           -- float16; null: it shows nothing
        alike TEXT                           -- sha256 of the earlier input that it looks like
    ) STRICT, WITHOUT ROWID;
    """,
)


def migrate(connection: sqlite3.Connection, version: int = 0) -> None:
    """Migrate a catalogue from a version to the newest schema, one transaction per step."""
    for number, script in enumerate(MIGRATIONS[version:], version + 1):
        connection.executescript(f"BEGIN IMMEDIATE; {script}; PRAGMA user_version = {number}; COMMIT;")
