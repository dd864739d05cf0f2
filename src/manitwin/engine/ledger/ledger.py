"""Write a ledger, and read from it as a run goes on."""

from __future__ import annotations

import json
import sqlite3
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from manitwin.engine.ledger.lock import hold_lock, lock_file
from manitwin.engine.ledger.migrations import migrate
from manitwin.engine.ledger.rows import ItemState, OpenItem, StageState
from manitwin.engine.ledger.soundness import check_whole, require_regular, sound
from manitwin.engine.task import Payload
from manitwin.errors import BackendError, UsageError
from manitwin.formats.json_file import parse_json_object

LEDGER = "ledger.sqlite"


class LedgerFull(BackendError):
    """The disk has no room for another row: what was not committed is lost, and found again by the next run."""


class Ledger:
    """One ledger file, open for writing by one process at a time.

    Owns: the connection and the lock. Changes are kept together until ``commit``.
    """

    def __init__(self, path: Path):
        """Open or make a ledger; raises UsageError where another run holds it, LedgerDamaged for a file that is none."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path = path
        self._lock = hold_lock(path)
        try:
            with sound(path):
                require_regular(path)
                self._new = not path.exists()
                self.connection = sqlite3.connect(path, isolation_level=None)
                self._open()
        except BaseException:
            self._lock.close()
            raise

    def _open(self) -> None:
        try:
            self.connection.execute("PRAGMA trusted_schema = OFF")
            self.connection.execute("PRAGMA journal_mode = WAL")
            # a power cut may lose the last rows, which are found again
            self.connection.execute("PRAGMA synchronous = NORMAL")
            migrate(self.connection, str(self.path))
            check_whole(self.connection, self.path)
            self.connection.execute("BEGIN")
        except BaseException:
            self.connection.close()
            raise

    def commit(self) -> None:
        """Make everything since the last commit permanent."""
        try:
            self.connection.execute("COMMIT")
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_FULL:
                raise
            if self.connection.in_transaction:  # SQLite may have rolled back by itself
                self.connection.execute("ROLLBACK")
            raise LedgerFull(f"{self.path}: {error}") from error
        finally:
            if not self.connection.in_transaction:
                self.connection.execute("BEGIN")

    def close(self, remove_new: bool = False) -> None:
        """Commit and give the ledger free; ``remove_new``: one that was made here and got no items is removed before."""
        removed = False
        try:
            self.commit()
            removed = remove_new and self._new and not self.connection.execute("SELECT 1 FROM items").fetchone()
            self.connection.execute("ROLLBACK")
        finally:
            self.connection.close()
            if removed:  # while the lock is held: nobody else can have made or filled it
                self.path.unlink()
                lock_file(self.path).unlink()
            self._lock.close()

    def add_items(self, payloads: Iterable[Payload]) -> tuple[list[int], int]:
        """Add items that are not there yet, in order, all or none; returns the numbers of all given, and how many are new."""
        given: dict[int, None] = {}
        new = 0
        self.commit()
        try:
            for payload in payloads:
                text = (_text(payload),)
                added = self.connection.execute("INSERT OR IGNORE INTO items (item) VALUES (?)", text)
                new += added.rowcount
                number = added.lastrowid if added.rowcount else self._number_of(text)
                given[int(number or 0)] = None
        except BaseException:
            self.connection.execute("ROLLBACK")
            self.connection.execute("BEGIN")
            raise
        self.commit()
        return list(given), new

    def _number_of(self, text: tuple[str]) -> int:
        return int(self.connection.execute("SELECT number FROM items WHERE item = ?", text).fetchone()[0])

    def restate(self, read: Callable[[Mapping[str, Any]], Payload]) -> None:
        """Rewrite payloads that an earlier version wrote in another form; all of a ledger have one form, so the first tells.

        ``read`` reads both forms.
        """
        rows = self.connection.execute("SELECT number, item FROM items ORDER BY number")
        first = rows.fetchone()
        if first is None or _text(read(_payload(first[1]))) == first[1]:
            return
        restated = [(_text(read(_payload(text))), number) for number, text in (first, *rows)]
        self.connection.executemany("UPDATE items SET item = ? WHERE number = ?", restated)
        self.commit()

    def begin_run(self, recipe_sha256: str, given: Collection[int] = (), *, replaces: bool = True) -> int:
        """Note the begin of a run: what an earlier one left running was cut off, which is nobody's failed attempt.

        Items that ended under another recipe are opened again, their attempts forgotten: those with the ``given`` numbers, or
        where none is given all. Where the recipe ``replaces`` nothing, only those that failed: there is nothing of them.
        """
        run = self.connection.execute(
            "INSERT INTO runs (started_at, recipe_sha256) VALUES (?, ?)", (time.time(), recipe_sha256)
        ).lastrowid
        self.connection.execute(
            "UPDATE stages SET state = 'waiting', attempts = max(attempts - 1, 0) WHERE state = 'running'"
        )
        self.reopen(self.ended_under_others(recipe_sha256, given, replaces=replaces))
        return int(run or 0)

    def end_run(self, run: int, how: str) -> None:
        """Note how a run ended."""
        self.connection.execute("UPDATE runs SET ended_at = ?, ended_how = ? WHERE run = ?", (time.time(), how, run))
        self.commit()

    def next_open(self, after: int, count: int) -> list[OpenItem]:
        """Return the next open items behind a number, in order."""
        rows = self.connection.execute(
            "SELECT number, item FROM items WHERE state = 'open' AND number > ? ORDER BY number LIMIT ?", (after, count)
        ).fetchall()
        return [OpenItem(number, _payload(text), self._attempts(number)) for number, text in rows]

    def payload(self, number: int) -> dict[str, Any]:
        """Return the JSON of an item's payload."""
        (text,) = self.connection.execute("SELECT item FROM items WHERE number = ?", (number,)).fetchone()
        return dict(_payload(text))

    def _attempts(self, number: int) -> dict[str, int]:
        rows = self.connection.execute(
            "SELECT stage, attempts FROM stages WHERE number = ? AND state <> 'done'", (number,)
        )
        return dict(rows)

    def superseded_rejection(self, number: int, twin_id: str) -> str | None:
        """Return the id under which an item was rejected before its input was changed, where no other item has it."""
        row = self.connection.execute(
            "SELECT twin_id FROM items WHERE number = ? AND twin_id <> ? AND reason IS NOT NULL AND revision IS NOT NULL"
            " AND twin_id NOT IN (SELECT twin_id FROM items WHERE number <> ? AND twin_id IS NOT NULL)",
            (number, twin_id, number),
        ).fetchone()
        return None if row is None else str(row[0])

    def identify(self, number: int, twin_id: str, kind: str) -> int | None:
        """Note whose twin an item is; where another item makes the same twin, end this one and return the other's number."""
        first = self.connection.execute(
            "SELECT number FROM items WHERE twin_id = ? AND state <> 'duplicate' AND number <> ?", (twin_id, number)
        ).fetchone()
        if first is None:
            self.connection.execute("UPDATE items SET twin_id = ?, kind = ? WHERE number = ?", (twin_id, kind, number))
            return None
        self.connection.execute(
            "UPDATE items SET twin_id = ?, kind = ?, state = 'duplicate', detail = ?, ended_at = ? WHERE number = ?",
            (twin_id, kind, f"the same input as item {first[0]}", time.time(), number),
        )
        return int(first[0])

    def stage_started(self, number: int, stage: str, attempts: int) -> None:
        """Note that a stage is given to a worker."""
        self.connection.execute(
            "INSERT INTO stages (number, stage, state, attempts, at) VALUES (?, ?, 'running', ?, ?)"
            " ON CONFLICT DO UPDATE SET state = 'running', attempts = excluded.attempts, at = excluded.at",
            (number, stage, attempts, time.time()),
        )

    def stage_ended(
        self,
        number: int,
        stage: str,
        state: StageState,
        *,
        attempts: int,
        key: str | None = None,
        ran: bool = False,
        seconds: float = 0.0,
        cpu_seconds: float = 0.0,
        cost_usd: float = 0.0,
        error: str | None = None,
    ) -> None:
        """Note how a stage ended: done (``ran`` now, or found), rejected, waiting for a service, or failed for good."""
        self.connection.execute(
            "INSERT INTO stages (number, stage, key, state, attempts, runs, seconds, cpu_seconds, cost_usd, error, at)"
            " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO UPDATE SET key = excluded.key,"
            " state = excluded.state, attempts = excluded.attempts, runs = runs + excluded.runs,"
            " seconds = excluded.seconds, cpu_seconds = excluded.cpu_seconds, cost_usd = excluded.cost_usd,"
            " error = excluded.error, at = excluded.at",
            (number, stage, key, state, attempts, int(ran), seconds, cpu_seconds, cost_usd, error, time.time()),
        )

    def item_ended(
        self,
        number: int,
        state: ItemState,
        *,
        recipe_sha256: str,
        reason: str | None = None,
        detail: str = "",
        revision: str | None = None,
    ) -> None:
        """Note how an item ended; a twin of a new revision is to be indexed again."""
        self.connection.execute(
            "UPDATE items SET state = ?, reason = ?, detail = ?, recipe_sha256 = ?, ended_at = ?,"
            " indexed = CASE WHEN revision IS ? THEN indexed ELSE 0 END, revision = ? WHERE number = ?",
            (state, reason, detail, recipe_sha256, time.time(), revision, revision, number),
        )

    def changed_since_end(self, numbers: Iterable[int], read: Callable[[Mapping[str, Any]], Payload]) -> list[int]:
        """Return those of the items with these numbers whose input was changed after they had ended."""
        found = []
        for number in numbers:
            row = self.connection.execute(
                "SELECT item, ended_at FROM items WHERE number = ? AND state <> 'open'", (number,)
            ).fetchone()
            modified_at = None if row is None else read(json.loads(row[0])).modified_at
            if modified_at is not None and modified_at > (row[1] or 0.0):
                found.append(number)
        return found

    def reopen(self, numbers: Iterable[int]) -> int:
        """Open ended items again, their attempts forgotten; returns how many."""
        count = 0
        for number in numbers:
            # a duplicate has the twin of another item, until its own bytes are read again
            self.connection.execute(
                "UPDATE items SET twin_id = CASE state WHEN 'duplicate' THEN NULL ELSE twin_id END, state = 'open'"
                " WHERE number = ?",
                (number,),
            )
            self.connection.execute("DELETE FROM stages WHERE number = ? AND state <> 'done'", (number,))
            count += 1
        self.commit()
        return count

    def revised(self, twin_id: str, revision: str) -> None:
        """Note that a finished twin was amended; it is to be indexed again."""
        self.connection.execute(
            "UPDATE items SET revision = ?, indexed = 0 WHERE twin_id = ? AND state = 'accepted'", (revision, twin_id)
        )

    def counts(self, numbers: Iterable[int] | None = None) -> dict[str, int]:
        """Return how many items are in each state: of all, or of those with these numbers."""
        if numbers is None:
            return dict(self.connection.execute("SELECT state, count(*) FROM items GROUP BY state"))
        wanted = set(numbers)
        rows = self.connection.execute("SELECT number, state FROM items")
        return dict(Counter(state for number, state in rows if number in wanted))

    def totals(self, recipe_sha256: str, given: Collection[int] = (), *, replaces: bool = True) -> tuple[int, int]:
        """Return how many items there are, and how many are open, or are opened again as ``begin_run`` does."""
        row = self.connection.execute("SELECT count(*), coalesce(sum(state = 'open'), 0) FROM items").fetchone()
        return int(row[0]), int(row[1]) + len(self.ended_under_others(recipe_sha256, given, replaces=replaces))

    def ended_under_others(
        self, recipe_sha256: str, given: Collection[int] = (), *, replaces: bool = True
    ) -> list[int]:
        """Return the numbers of items that ended under another recipe: of the given ones or of all, as ``begin_run`` does."""
        rows = self.connection.execute(
            "SELECT number FROM items WHERE state NOT IN ('open', 'duplicate') AND recipe_sha256 <> ?"
            " AND (? OR state = 'failed')",
            (recipe_sha256, replaces),
        )
        wanted = set(given)
        return [number for (number,) in rows if not wanted or number in wanted]

    def ended(self, given: Collection[int] = ()) -> list[tuple[int, str]]:
        """Return the numbers and twin ids of accepted and rejected items: of the given ones, or of all."""
        rows = self.connection.execute(
            "SELECT number, twin_id FROM items WHERE state IN ('accepted', 'rejected') AND twin_id IS NOT NULL ORDER BY number"
        )
        wanted = set(given)
        return [(number, twin_id) for number, twin_id in rows if not wanted or number in wanted]

    def any_indexed(self) -> bool:
        """Tell whether any twin is marked as indexed."""
        return self.connection.execute("SELECT 1 FROM items WHERE indexed = 1 LIMIT 1").fetchone() is not None

    def forget_indexed(self) -> None:
        """Mark all twins as not indexed."""
        self.connection.execute("UPDATE items SET indexed = 0")
        self.commit()

    def not_indexed(self, count: int) -> list[str]:
        """Return ids of finished twins that no table has yet."""
        rows = self.connection.execute(
            "SELECT twin_id FROM items WHERE indexed = 0 AND state IN ('accepted', 'rejected') AND revision IS NOT NULL"
            " ORDER BY number LIMIT ?",
            (count,),
        )
        return [twin_id for (twin_id,) in rows]

    def indexed(self, twin_ids: Iterable[str]) -> None:
        """Note that the tables have these twins."""
        self.connection.executemany("UPDATE items SET indexed = 1 WHERE twin_id = ?", ((i,) for i in twin_ids))


def _payload(text: str) -> dict[str, Any]:
    return parse_json_object(text, "the ledger's item", UsageError, remedy="run manitwin check", file_names=True)


def _text(payload: Payload) -> str:
    return json.dumps(payload.to_json(), sort_keys=True)
