"""Transactions that happen whole or not at all, and errors that name the file."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from manitwin.errors import UsageError
from manitwin.formats.sqlite_store import name_file_in_errors, schema_flaw, transaction

REMEDY = "is no list that can be read ({cause}); give another"


def _made(connection: sqlite3.Connection) -> None:
    connection.execute("CREATE TABLE rows (place TEXT PRIMARY KEY) STRICT")


@pytest.fixture
def connection() -> sqlite3.Connection:
    opened = sqlite3.connect(":memory:", isolation_level=None)
    _made(opened)
    return opened


def _count(connection: sqlite3.Connection) -> int:
    return int(connection.execute("SELECT count(*) FROM rows").fetchone()[0])


def test_what_a_block_did_is_committed_when_it_ends(connection: sqlite3.Connection) -> None:
    with transaction(connection):
        connection.execute("INSERT INTO rows VALUES ('a')")
    assert not connection.in_transaction
    assert _count(connection) == 1


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_nothing_of_a_block_that_fails_is_kept(connection: sqlite3.Connection, error: type[BaseException]) -> None:
    with pytest.raises(error), transaction(connection):
        connection.execute("INSERT INTO rows VALUES ('a')")
        raise error
    assert not connection.in_transaction
    assert _count(connection) == 0


def test_errors_of_the_disk_and_of_the_file_say_which_file(connection: sqlite3.Connection) -> None:
    path = Path("list.sqlite")
    disk = r"^list\.sqlite: no such table: other; mend the disk or its permissions"
    with pytest.raises(UsageError, match=disk), name_file_in_errors(path, REMEDY):
        connection.execute("SELECT * FROM other")
    file = r"^list\.sqlite: is no list that can be read \(UNIQUE.*\); give another$"
    with pytest.raises(UsageError, match=file), name_file_in_errors(path, REMEDY), transaction(connection):
        connection.executemany("INSERT INTO rows VALUES (?)", [("a",), ("a",)])
    assert _count(connection) == 0


def test_a_database_with_more_than_its_tables_has_a_flaw(connection: sqlite3.Connection) -> None:
    assert schema_flaw(connection, _made, tables_of="a list") is None
    connection.execute("CREATE VIEW other AS SELECT * FROM rows")
    assert schema_flaw(connection, _made, tables_of="a list") == "its tables do not match those of a list"
