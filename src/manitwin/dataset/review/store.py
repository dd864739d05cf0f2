"""Review store: append-only, durable SQLite storage of verdicts.

A review is one committed transaction. In write-ahead mode with ``synchronous = FULL``, a commit returns after the log was synced
(https://sqlite.org/pragma.html#pragma_synchronous). Neither a killed process nor a power failure then loses it, and reports can
read while a server writes. The file must be on a local disk: write-ahead mode needs shared memory, which network file systems do
not provide.
"""

from __future__ import annotations

import json
import os
import sqlite3
import statistics
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from manitwin.dataset.review.queues import Plan
from manitwin.dataset.review.schema import migrate
from manitwin.dataset.review.verdicts import Review, reason_of
from manitwin.errors import UsageError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.json_file import parse_json_object
from manitwin.formats.sqlite_store import BUSY_S, damaged_file_error, name_file_in_errors, schema_flaw, transaction
from manitwin.twin.dataset_root import DatasetRoot

REVIEWS = "reviews.sqlite"
_DAMAGED = "not a readable review store ({cause}); replace it with a copy, or move it away"
_LIVE = "kind = 'review' AND number NOT IN (SELECT undoes FROM events WHERE undoes IS NOT NULL)"


@dataclass(frozen=True)
class Stored:
    """A review with its number, which increases with time, and the time of confirmation in seconds since the epoch."""

    number: int
    at: float
    review: Review


def reviews_path(root: DatasetRoot) -> Path:
    """Return the path of a data set's review store; raises UsageError for a URL."""
    if root.local is None:
        raise UsageError(
            f"{root.url}: reviews are stored beside a data set on a local disk; copy the data set to a disk first"
        )
    return root.local / REVIEWS


class ReviewStore:
    """A review store, open for reading and appending. Safe for concurrent threads and processes.

    Raises UsageError if the file is missing and ``make`` is False, and if it is damaged or not a review store.
    """

    def __init__(self, path: Path, *, make: bool = True, now: Callable[[], float] = time.time):
        self.path, self._now, self._lock = path, now, threading.RLock()
        if not make and not path.is_file():
            raise UsageError(
                f"{path}: no reviews yet; `manitwin review DATASET` or `manitwin review import` creates some"
            )
        if os.path.lexists(path):
            open_regular(path, UsageError, inside=path.parent, name=str(path)).close()
        with self._sqlite_errors():
            self._connection = sqlite3.connect(path, isolation_level=None, check_same_thread=False, timeout=BUSY_S)
            try:
                self._connection.execute("PRAGMA trusted_schema = OFF")
                self._connection.execute("PRAGMA journal_mode = WAL")
                self._connection.execute("PRAGMA synchronous = FULL")
                migrate(self._connection, str(path))
                flaw = schema_flaw(
                    self._connection, lambda ours: migrate(ours, ":memory:"), tables_of="a store of reviews"
                )
                if flaw is not None:
                    raise damaged_file_error(path, flaw, _DAMAGED)
            except BaseException:
                self._connection.close()
                raise

    def __enter__(self) -> ReviewStore:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; confirmed reviews are already on disk."""
        with self._lock:
            self._connection.close()

    def add(self, reviews: Iterable[Review], requests: Iterable[str]) -> int:
        """Append reviews atomically, each with the sender's request id; return how many were new.

        The annotator's draft on a reviewed twin is deleted.
        """
        added = 0
        with self._writing() as connection:
            for review, request in zip(reviews, requests, strict=True):
                row = (review.annotator, review.twin_id, review.revision, request, self._now(), _text(review))
                added += connection.execute(
                    "INSERT INTO events (kind, annotator, twin_id, revision, request, at, body)"
                    " VALUES ('review', ?, ?, ?, ?, ?, ?) ON CONFLICT (request) DO NOTHING",
                    row,
                ).rowcount
                connection.execute("DELETE FROM drafts WHERE annotator = ? AND twin_id = ?", row[:2])
        return added

    def undo(self, annotator: str, request: str) -> Stored | None:
        """Withdraw the last standing review of an annotator by appending an event and return it; it becomes a draft. None if none
        stands.

        Repeating a ``request`` withdraws nothing more.
        """
        with self._writing() as connection:
            before = connection.execute("SELECT undoes FROM events WHERE request = ?", (request,)).fetchone()
            if before is not None:
                return self._rows("number = ?", (before[0],))[0]
            last = self._rows(f"{_LIVE} AND annotator = ? ORDER BY number DESC LIMIT 1", (annotator,))
            if not last:
                return None
            [stored] = last
            said = stored.review
            connection.execute(
                "INSERT INTO events (kind, annotator, twin_id, revision, undoes, request, at, body)"
                " VALUES ('undo', ?, ?, ?, ?, ?, ?, '{}')",
                (annotator, said.twin_id, said.revision, stored.number, request, self._now()),
            )
            self._put_draft(connection, annotator, said.twin_id, said.model_dump(mode="json"))
            return stored

    def record_successors(self, revisions: Mapping[str, tuple[str, str]]) -> None:
        """Record pairs of revisions (before, after) of twins that differ in nothing that is judged; reviews of the former stay
        valid.
        """
        with self._writing() as connection:
            for twin_id, (before, after) in revisions.items():
                connection.execute(
                    "INSERT INTO successors VALUES (?, ?, ?, ?)"
                    " ON CONFLICT DO UPDATE SET after = excluded.after, at = excluded.at",
                    (twin_id, before, after, self._now()),
                )

    def standing(self) -> list[Stored]:
        """Return the last standing review of each annotator, twin and revision, in order of their numbers.

        The revision of a review is replaced by the last one that ``follow`` recorded as its successor.
        """
        latest = f"SELECT max(number) FROM events WHERE {_LIVE} GROUP BY annotator, twin_id, revision"
        followed, last = self.successor_function(), dict[tuple[str, str, str], Stored]()
        for stored in self._rows(f"number IN ({latest}) ORDER BY number", ()):
            said = stored.review
            now = followed(said.twin_id, said.revision)
            moved = replace(stored, review=said.model_copy(update={"revision": now}))
            last[said.annotator, said.twin_id, now] = moved
        return sorted(last.values(), key=lambda stored: stored.number)

    def successor_function(self) -> Callable[[str, str], str]:
        """Return a function that maps a twin id and revision to the last recorded successor of the revision."""
        known = {
            (twin, before): after
            for twin, before, after in self._select("SELECT twin_id, before, after FROM successors", ())
        }

        def last(twin_id: str, revision: str) -> str:
            seen = {revision}
            while (after := known.get((twin_id, revision))) is not None and after not in seen:
                seen.add(after)
                revision = after
            return revision

        return last

    def of_twin(self, twin_id: str, annotator: str) -> Stored | None:
        """Return the last standing review of an annotator on a twin; None if there is none."""
        found = self._rows(
            f"{_LIVE} AND twin_id = ? AND annotator = ? ORDER BY number DESC LIMIT 1", (twin_id, annotator)
        )
        if not found:
            return None
        said = found[0].review
        now = self.successor_function()(twin_id, said.revision)
        return replace(found[0], review=said.model_copy(update={"revision": now}))

    def median_seconds(self, annotator: str) -> float | None:
        """Return the median duration of an annotator's standing reviews in seconds; None if no review states one."""
        rows = self._select(
            f"SELECT json_extract(body, '$.seconds') FROM events WHERE {_LIVE} AND annotator = ?", (annotator,)
        )
        told = [float(seconds) for (seconds,) in rows if isinstance(seconds, int | float)]
        return statistics.median(told) if told else None

    def undo_counts(self) -> dict[str, int]:
        """Return the number of withdrawn reviews per annotator."""
        rows = self._select("SELECT annotator, count(*) FROM events WHERE kind = 'undo' GROUP BY annotator", ())
        return dict(rows)

    def put_draft(self, annotator: str, twin_id: str, body: dict[str, Any]) -> None:
        """Store an annotator's unconfirmed input on a twin."""
        with self._writing() as connection:
            self._put_draft(connection, annotator, twin_id, body)

    def draft(self, annotator: str, twin_id: str) -> dict[str, Any] | None:
        """Return an annotator's unconfirmed input on a twin; None if there is none."""
        rows = self._select("SELECT body FROM drafts WHERE annotator = ? AND twin_id = ?", (annotator, twin_id))
        return parse_json_object(rows[0][0], f"{self.path}: a draft", UsageError) if rows else None

    def _put_draft(self, connection: sqlite3.Connection, annotator: str, twin_id: str, body: dict[str, Any]) -> None:
        connection.execute(
            "INSERT INTO drafts VALUES (?, ?, ?, ?) ON CONFLICT DO UPDATE SET at = excluded.at, body = excluded.body",
            (annotator, twin_id, self._now(), json.dumps(body, sort_keys=True)),
        )

    def plan(self) -> Plan | None:
        """Return the last sample that was drawn; None if there is none."""
        rows = self._select("SELECT body FROM events WHERE kind = 'sample' ORDER BY number DESC LIMIT 1", ())
        if not rows:
            return None
        said = parse_json_object(rows[0][0], f"{self.path}: a sample", UsageError)
        try:
            return Plan(tuple(said["twins"]), said["seed"], said["overlap"], said["raters"])
        except (KeyError, TypeError) as error:
            raise damaged_file_error(self.path, f"a sample without {error}", _DAMAGED) from error

    def add_plan(self, plan: Plan) -> None:
        """Append a sample unless it equals the last one."""
        if self.plan() == plan:
            return
        body = {"twins": list(plan.twins), "seed": plan.seed, "overlap": plan.overlap, "raters": plan.raters}
        with self._writing() as connection:
            connection.execute(
                "INSERT INTO events (kind, at, body) VALUES ('sample', ?, ?)", (self._now(), json.dumps(body))
            )

    def add_annotator(self, name: str) -> None:
        """Register an annotator; no effect if already registered."""
        with self._writing() as connection:
            connection.execute("INSERT INTO annotators VALUES (?, ?) ON CONFLICT DO NOTHING", (name, self._now()))

    def annotators(self) -> list[str]:
        """Return the sorted names of all annotators."""
        return [name for (name,) in self._select("SELECT name FROM annotators ORDER BY name", ())]

    def annotators_by_revision(self) -> dict[str, dict[str, set[str]]]:
        """Return the annotators of the standing reviews, by twin and revision."""
        found: dict[str, dict[str, set[str]]] = {}
        followed = self.successor_function()
        rows = self._select(f"SELECT DISTINCT twin_id, revision, annotator FROM events WHERE {_LIVE}", ())
        for twin_id, revision, annotator in rows:
            found.setdefault(twin_id, {}).setdefault(followed(twin_id, revision), set()).add(annotator)
        return found

    def _rows(self, where: str, values: tuple[Any, ...]) -> list[Stored]:
        rows = self._select(f"SELECT number, at, body FROM events WHERE {where}", values)
        return [Stored(number, at, self._review(number, body)) for number, at, body in rows]

    def _select(self, sql: str, values: tuple[Any, ...]) -> list[Any]:
        with self._lock, self._sqlite_errors():
            return self._connection.execute(sql, values).fetchall()

    def _review(self, number: int, body: str) -> Review:
        try:
            return Review.model_validate_json(body)
        except ValidationError as error:
            raise damaged_file_error(self.path, f"event {number}: {reason_of(error)}", _DAMAGED) from error

    @contextmanager
    def _writing(self) -> Iterator[sqlite3.Connection]:
        """Provide a transaction that is durable once the block ends without an error, and is otherwise rolled back."""
        with self._lock, self._sqlite_errors(), transaction(self._connection):
            yield self._connection

    def _sqlite_errors(self) -> AbstractContextManager[None]:
        return name_file_in_errors(self.path, _DAMAGED)


def _text(review: Review) -> str:
    return json.dumps(review.model_dump(mode="json"), sort_keys=True)
