"""The store of reviews: SQLite in which verdicts are only appended, and what was confirmed is on the disk.

A review is one committed transaction. In write-ahead mode with ``synchronous = FULL`` a commit returns after the log was synced
(https://sqlite.org/pragma.html#pragma_synchronous): neither a killed process nor a power cut loses it, and reports read while a
server writes. The file must lie on a local disk: that mode needs shared memory, which network file systems have not.
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
from manitwin.formats.sqlite_store import BUSY_S, damaged, errors_named, flaw_in, transaction
from manitwin.twin.dataset_root import DatasetRoot

REVIEWS = "reviews.sqlite"
_DAMAGED = "not a readable review store ({cause}); replace it with a copy, or move it away"
_LIVE = "kind = 'review' AND number NOT IN (SELECT undoes FROM events WHERE undoes IS NOT NULL)"


@dataclass(frozen=True)
class Stored:
    """A review with its number, which grows in time, and when (seconds since the epoch) it was confirmed."""

    number: int
    at: float
    review: Review


def reviews_path(root: DatasetRoot) -> Path:
    """Return where the reviews of a data set lie; raises UsageError for a URL."""
    if root.local is None:
        raise UsageError(
            f"{root.url}: reviews are stored beside a data set on a local disk; copy the data set to a disk first"
        )
    return root.local / REVIEWS


class ReviewStore:
    """One store, open for reading and appending; threads and processes may share it.

    Raises UsageError where there is none and ``make`` is False, and for a file that is none or is damaged.
    """

    def __init__(self, path: Path, *, make: bool = True, now: Callable[[], float] = time.time):
        self.path, self._now, self._lock = path, now, threading.RLock()
        if not make and not path.is_file():
            raise UsageError(
                f"{path}: no reviews yet; `manitwin review DATASET` or `manitwin review import` creates some"
            )
        if os.path.lexists(path):
            open_regular(path, UsageError, inside=path.parent, name=str(path)).close()
        with self._sound():
            self._connection = sqlite3.connect(path, isolation_level=None, check_same_thread=False, timeout=BUSY_S)
            try:
                self._connection.execute("PRAGMA trusted_schema = OFF")
                self._connection.execute("PRAGMA journal_mode = WAL")
                self._connection.execute("PRAGMA synchronous = FULL")
                migrate(self._connection, str(path))
                flaw = flaw_in(self._connection, lambda ours: migrate(ours, ":memory:"), tables_of="a store of reviews")
                if flaw is not None:
                    raise damaged(path, flaw, _DAMAGED)
            except BaseException:
                self._connection.close()
                raise

    def __enter__(self) -> ReviewStore:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; what is confirmed is there already."""
        with self._lock:
            self._connection.close()

    def add(self, reviews: Iterable[Review], requests: Iterable[str]) -> int:
        """Append reviews, all or none, each with the sender's own id; returns how many were not there yet.

        An annotator's draft of a twin ends with their review of it.
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
        """Take back the last review of an annotator that stands, by another event; it becomes their draft. None: none stands.

        Sent again, ``request`` takes back nothing more.
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

    def follow(self, revisions: Mapping[str, tuple[str, str]]) -> None:
        """Note revisions of twins that differ from the one before by nothing that is judged: what was said of that stands."""
        with self._writing() as connection:
            for twin_id, (before, after) in revisions.items():
                connection.execute(
                    "INSERT INTO successors VALUES (?, ?, ?, ?)"
                    " ON CONFLICT DO UPDATE SET after = excluded.after, at = excluded.at",
                    (twin_id, before, after, self._now()),
                )

    def standing(self) -> list[Stored]:
        """Return the last review that stands of each annotator, twin and revision, in the order of their numbers.

        A review is of the revision that followed the one that was seen, where ``follow`` says so.
        """
        latest = f"SELECT max(number) FROM events WHERE {_LIVE} GROUP BY annotator, twin_id, revision"
        followed, last = self.followed(), dict[tuple[str, str, str], Stored]()
        for stored in self._rows(f"number IN ({latest}) ORDER BY number", ()):
            said = stored.review
            now = followed(said.twin_id, said.revision)
            moved = replace(stored, review=said.model_copy(update={"revision": now}))
            last[said.annotator, said.twin_id, now] = moved
        return sorted(last.values(), key=lambda stored: stored.number)

    def followed(self) -> Callable[[str, str], str]:
        """Return what tells of a twin's revision the last one that followed it."""
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
        """Return the last review that stands of an annotator on a twin."""
        found = self._rows(
            f"{_LIVE} AND twin_id = ? AND annotator = ? ORDER BY number DESC LIMIT 1", (twin_id, annotator)
        )
        if not found:
            return None
        said = found[0].review
        now = self.followed()(twin_id, said.revision)
        return replace(found[0], review=said.model_copy(update={"revision": now}))

    def median_seconds(self, annotator: str) -> float | None:
        """Return the median time that an annotator's reviews that stand took; None: none says how long."""
        rows = self._select(
            f"SELECT json_extract(body, '$.seconds') FROM events WHERE {_LIVE} AND annotator = ?", (annotator,)
        )
        told = [float(seconds) for (seconds,) in rows if isinstance(seconds, int | float)]
        return statistics.median(told) if told else None

    def undone(self) -> dict[str, int]:
        """Return how many reviews each annotator has taken back."""
        rows = self._select("SELECT annotator, count(*) FROM events WHERE kind = 'undo' GROUP BY annotator", ())
        return dict(rows)

    def put_draft(self, annotator: str, twin_id: str, body: dict[str, Any]) -> None:
        """Keep what an annotator has typed of a twin and not confirmed."""
        with self._writing() as connection:
            self._put_draft(connection, annotator, twin_id, body)

    def draft(self, annotator: str, twin_id: str) -> dict[str, Any] | None:
        """Return what an annotator has typed of a twin and not confirmed; None where there is nothing."""
        rows = self._select("SELECT body FROM drafts WHERE annotator = ? AND twin_id = ?", (annotator, twin_id))
        return parse_json_object(rows[0][0], f"{self.path}: a draft", UsageError) if rows else None

    def _put_draft(self, connection: sqlite3.Connection, annotator: str, twin_id: str, body: dict[str, Any]) -> None:
        connection.execute(
            "INSERT INTO drafts VALUES (?, ?, ?, ?) ON CONFLICT DO UPDATE SET at = excluded.at, body = excluded.body",
            (annotator, twin_id, self._now(), json.dumps(body, sort_keys=True)),
        )

    def plan(self) -> Plan | None:
        """Return the last sample that was drawn; None: none was."""
        rows = self._select("SELECT body FROM events WHERE kind = 'sample' ORDER BY number DESC LIMIT 1", ())
        if not rows:
            return None
        said = parse_json_object(rows[0][0], f"{self.path}: a sample", UsageError)
        try:
            return Plan(tuple(said["twins"]), said["seed"], said["overlap"], said["raters"])
        except (KeyError, TypeError) as error:
            raise damaged(self.path, f"a sample without {error}", _DAMAGED) from error

    def add_plan(self, plan: Plan) -> None:
        """Append a sample, unless it is the last one already."""
        if self.plan() == plan:
            return
        body = {"twins": list(plan.twins), "seed": plan.seed, "overlap": plan.overlap, "raters": plan.raters}
        with self._writing() as connection:
            connection.execute(
                "INSERT INTO events (kind, at, body) VALUES ('sample', ?, ?)", (self._now(), json.dumps(body))
            )

    def add_annotator(self, name: str) -> None:
        """Note that somebody reviews; who is noted already stays so."""
        with self._writing() as connection:
            connection.execute("INSERT INTO annotators VALUES (?, ?) ON CONFLICT DO NOTHING", (name, self._now()))

    def annotators(self) -> list[str]:
        """Return the names of all who review, sorted."""
        return [name for (name,) in self._select("SELECT name FROM annotators ORDER BY name", ())]

    def judged(self) -> dict[str, dict[str, set[str]]]:
        """Return the annotators of the reviews that stand, by twin and revision."""
        found: dict[str, dict[str, set[str]]] = {}
        followed = self.followed()
        rows = self._select(f"SELECT DISTINCT twin_id, revision, annotator FROM events WHERE {_LIVE}", ())
        for twin_id, revision, annotator in rows:
            found.setdefault(twin_id, {}).setdefault(followed(twin_id, revision), set()).add(annotator)
        return found

    def _rows(self, where: str, values: tuple[Any, ...]) -> list[Stored]:
        rows = self._select(f"SELECT number, at, body FROM events WHERE {where}", values)
        return [Stored(number, at, self._review(number, body)) for number, at, body in rows]

    def _select(self, sql: str, values: tuple[Any, ...]) -> list[Any]:
        with self._lock, self._sound():
            return self._connection.execute(sql, values).fetchall()

    def _review(self, number: int, body: str) -> Review:
        try:
            return Review.model_validate_json(body)
        except ValidationError as error:
            raise damaged(self.path, f"event {number}: {reason_of(error)}", _DAMAGED) from error

    @contextmanager
    def _writing(self) -> Iterator[sqlite3.Connection]:
        """Give a transaction that is on the disk when the block has ended well, and never was otherwise."""
        with self._lock, self._sound(), transaction(self._connection):
            yield self._connection

    def _sound(self) -> AbstractContextManager[None]:
        return errors_named(self.path, _DAMAGED)


def _text(review: Review) -> str:
    return json.dumps(review.model_dump(mode="json"), sort_keys=True)
