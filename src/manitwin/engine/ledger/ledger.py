"""The ledger for the driver: write the state of items and stages, and query it during a run."""

from __future__ import annotations

import json
import sqlite3
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from manitwin.engine.ledger.integrity import check_integrity, convert_sqlite_errors, require_regular
from manitwin.engine.ledger.lock import hold_lock, lock_file
from manitwin.engine.ledger.migrations import migrate
from manitwin.engine.ledger.rows import ItemState, OpenItem, StageState
from manitwin.engine.task import Payload
from manitwin.errors import BackendError, UsageError
from manitwin.formats.json_file import parse_json_object

LEDGER = "ledger.sqlite"


class LedgerFull(BackendError):
    """The disk is full: uncommitted rows are lost, and the next run finds the results again."""


class Ledger:
    """A ledger file, open for writing by one process at a time.

    Owns the connection and the lock. Changes accumulate in a transaction until ``commit``.
    """

    def __init__(self, path: Path):
        """Open or create a ledger. Raises UsageError if another run holds it, LedgerDamaged if the file is not a ledger."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path = path
        self._lock = hold_lock(path)
        try:
            with convert_sqlite_errors(path):
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
            # a power cut may lose the last rows; their results are found again
            self.connection.execute("PRAGMA synchronous = NORMAL")
            migrate(self.connection, str(self.path))
            check_integrity(self.connection, self.path)
            self.connection.execute("BEGIN")
        except BaseException:
            self.connection.close()
            raise

    def commit(self) -> None:
        """Commit the transaction and begin a new one. Raises LedgerFull if the disk is full."""
        try:
            self.connection.execute("COMMIT")
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_FULL:
                raise
            if self.connection.in_transaction:  # SQLite may have rolled back already
                self.connection.execute("ROLLBACK")
            raise LedgerFull(f"{self.path}: {error}") from error
        finally:
            if not self.connection.in_transaction:
                self.connection.execute("BEGIN")

    def close(self, remove_new: bool = False) -> None:
        """Commit and release the ledger; with ``remove_new``, delete it if it was created here and has no items."""
        removed = False
        try:
            self.commit()
            removed = remove_new and self._new and not self.connection.execute("SELECT 1 FROM items").fetchone()
            self.connection.execute("ROLLBACK")
        finally:
            self.connection.close()
            if removed:  # while the lock is held, so that no other run can have created or filled it
                self.path.unlink()
                lock_file(self.path).unlink()
            self._lock.close()

    def add_items(self, payloads: Iterable[Payload]) -> tuple[list[int], int]:
        """Add all items that are not in the ledger, in order and atomically; return the numbers of all given items, and how many
        are new.
        """
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

    def rewrite_payloads(self, read: Callable[[Mapping[str, Any]], Payload]) -> None:
        """Rewrite payloads of an earlier version in the current form; ``read`` parses both forms.

        All payloads of a ledger have the same form, so that only the first is compared.
        """
        rows = self.connection.execute("SELECT number, item FROM items ORDER BY number")
        first = rows.fetchone()
        if first is None or _text(read(_payload(first[1]))) == first[1]:
            return
        restated = [(_text(read(_payload(text))), number) for number, text in (first, *rows)]
        self.connection.executemany("UPDATE items SET item = ? WHERE number = ?", restated)
        self.commit()

    def begin_run(self, recipe_sha256: str, given: Collection[int] = (), *, replaces: bool = True) -> int:
        """Record the start of a run and return its number.

        Stages left "running" by an earlier run were interrupted, which does not count as a failed attempt. Items that ended
        under another recipe are reopened and their attempts reset: those with the ``given`` numbers, or all if none is given.
        If not ``replaces``, only failed items are reopened, because they have no result.
        """
        run = self.connection.execute(
            "INSERT INTO runs (started_at, recipe_sha256) VALUES (?, ?)", (time.time(), recipe_sha256)
        ).lastrowid
        self.connection.execute(
            "UPDATE stages SET state = 'waiting', attempts = max(attempts - 1, 0) WHERE state = 'running'"
        )
        self.reopen(self.ended_under_other_recipes(recipe_sha256, given, replaces=replaces))
        return int(run or 0)

    def end_run(self, run: int, how: str) -> None:
        """Record how a run ended."""
        self.connection.execute("UPDATE runs SET ended_at = ?, ended_how = ? WHERE run = ?", (time.time(), how, run))
        self.commit()

    def next_open(self, after: int, count: int) -> list[OpenItem]:
        """Return the next ``count`` open items with numbers above ``after``, in order."""
        rows = self.connection.execute(
            "SELECT number, item FROM items WHERE state = 'open' AND number > ? ORDER BY number LIMIT ?", (after, count)
        ).fetchall()
        return [OpenItem(number, _payload(text), self._attempts(number)) for number, text in rows]

    def payload(self, number: int) -> dict[str, Any]:
        """Return an item's payload as JSON."""
        (text,) = self.connection.execute("SELECT item FROM items WHERE number = ?", (number,)).fetchone()
        return dict(_payload(text))

    def _attempts(self, number: int) -> dict[str, int]:
        rows = self.connection.execute(
            "SELECT stage, attempts FROM stages WHERE number = ? AND state <> 'done'", (number,)
        )
        return dict(rows)

    def superseded_rejection(self, number: int, twin_id: str) -> str | None:
        """Return the id under which an item was rejected before its input changed, if no other item has that id."""
        row = self.connection.execute(
            "SELECT twin_id FROM items WHERE number = ? AND twin_id <> ? AND reason IS NOT NULL AND revision IS NOT NULL"
            " AND twin_id NOT IN (SELECT twin_id FROM items WHERE number <> ? AND twin_id IS NOT NULL)",
            (number, twin_id, number),
        ).fetchone()
        return None if row is None else str(row[0])

    def identify(self, number: int, twin_id: str, kind: str) -> int | None:
        """Store an item's twin id; if another item has the same id, end this one as a duplicate and return the other's number."""
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
        """Record that a stage was submitted to a worker."""
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
        """Record how a stage ended: done (``ran`` now, or reused), rejected, waiting for a retry, or failed."""
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
        """Record how an item ended; a twin with a new revision is marked for indexing."""
        self.connection.execute(
            "UPDATE items SET state = ?, reason = ?, detail = ?, recipe_sha256 = ?, ended_at = ?,"
            " indexed = CASE WHEN revision IS ? THEN indexed ELSE 0 END, revision = ? WHERE number = ?",
            (state, reason, detail, recipe_sha256, time.time(), revision, revision, number),
        )

    def changed_since_end(self, numbers: Iterable[int], read: Callable[[Mapping[str, Any]], Payload]) -> list[int]:
        """Return the numbers among ``numbers`` of items whose input was modified after they had ended."""
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
        """Reopen ended items and reset their attempts; return how many."""
        count = 0
        for number in numbers:
            # a duplicate has another item's twin id until its own bytes are read again
            self.connection.execute(
                "UPDATE items SET twin_id = CASE state WHEN 'duplicate' THEN NULL ELSE twin_id END, state = 'open'"
                " WHERE number = ?",
                (number,),
            )
            self.connection.execute("DELETE FROM stages WHERE number = ? AND state <> 'done'", (number,))
            count += 1
        self.commit()
        return count

    def record_revision(self, twin_id: str, revision: str) -> None:
        """Record that a finished twin was amended, and mark it for indexing."""
        self.connection.execute(
            "UPDATE items SET revision = ?, indexed = 0 WHERE twin_id = ? AND state = 'accepted'", (revision, twin_id)
        )

    def counts(self, numbers: Iterable[int] | None = None) -> dict[str, int]:
        """Return the number of items by state: of all items, or of those with the given numbers."""
        if numbers is None:
            return dict(self.connection.execute("SELECT state, count(*) FROM items GROUP BY state"))
        wanted = set(numbers)
        rows = self.connection.execute("SELECT number, state FROM items")
        return dict(Counter(state for number, state in rows if number in wanted))

    def totals(self, recipe_sha256: str, given: Collection[int] = (), *, replaces: bool = True) -> tuple[int, int]:
        """Return the total number of items, and how many are open or would be reopened by ``begin_run``."""
        row = self.connection.execute("SELECT count(*), coalesce(sum(state = 'open'), 0) FROM items").fetchone()
        return int(row[0]), int(row[1]) + len(self.ended_under_other_recipes(recipe_sha256, given, replaces=replaces))

    def ended_under_other_recipes(
        self, recipe_sha256: str, given: Collection[int] = (), *, replaces: bool = True
    ) -> list[int]:
        """Return the numbers of items that ended under another recipe: among the given ones or all, as in ``begin_run``."""
        rows = self.connection.execute(
            "SELECT number FROM items WHERE state NOT IN ('open', 'duplicate') AND recipe_sha256 <> ?"
            " AND (? OR state = 'failed')",
            (recipe_sha256, replaces),
        )
        wanted = set(given)
        return [number for (number,) in rows if not wanted or number in wanted]

    def ended_items(self, given: Collection[int] = ()) -> list[tuple[int, str]]:
        """Return the numbers and twin ids of accepted and rejected items: of the given ones, or of all."""
        rows = self.connection.execute(
            "SELECT number, twin_id FROM items WHERE state IN ('accepted', 'rejected') AND twin_id IS NOT NULL ORDER BY number"
        )
        wanted = set(given)
        return [(number, twin_id) for number, twin_id in rows if not wanted or number in wanted]

    def any_indexed(self) -> bool:
        """Return whether any twin is marked as indexed."""
        return self.connection.execute("SELECT 1 FROM items WHERE indexed = 1 LIMIT 1").fetchone() is not None

    def clear_indexed(self) -> None:
        """Mark all twins as not indexed."""
        self.connection.execute("UPDATE items SET indexed = 0")
        self.commit()

    def unindexed_ids(self, count: int) -> list[str]:
        """Return the ids of up to ``count`` finished twins that are not yet in the tables."""
        rows = self.connection.execute(
            "SELECT twin_id FROM items WHERE indexed = 0 AND state IN ('accepted', 'rejected') AND revision IS NOT NULL"
            " ORDER BY number LIMIT ?",
            (count,),
        )
        return [twin_id for (twin_id,) in rows]

    def mark_indexed(self, twin_ids: Iterable[str]) -> None:
        """Mark twins as indexed."""
        self.connection.executemany("UPDATE items SET indexed = 1 WHERE twin_id = ?", ((i,) for i in twin_ids))


def _payload(text: str) -> dict[str, Any]:
    return parse_json_object(text, "the ledger's item", UsageError, remedy="run manitwin check", file_names=True)


def _text(payload: Payload) -> str:
    return json.dumps(payload.to_json(), sort_keys=True)
