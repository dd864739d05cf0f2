"""Queries on a ledger: progress, rate and cost of a run, the history of one item, and the items that were not accepted."""

from __future__ import annotations

import json
import sqlite3
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from manitwin.engine.ledger.rows import ITEM_STATES, ItemRow, StageState
from manitwin.engine.stage import ASSEMBLE, INPUT
from manitwin.errors import UsageError

RATE_OVER_S = 600.0
StageOrder = Callable[[str], Any]


@dataclass(frozen=True)
class StageRow:
    """The ledger's row of one stage of one item."""

    stage: str
    key: str | None
    state: StageState
    attempts: int
    seconds: float
    cpu_seconds: float
    cost_usd: float
    error: str | None


@dataclass(frozen=True)
class StageProgress:
    """Totals of one stage over all items; the mean seconds are over the items that ran it."""

    stage: str
    done: int
    running: int
    waiting: int
    rejected: int
    failed: int
    mean_seconds: float
    mean_cpu_seconds: float
    cost_usd: float


@dataclass(frozen=True)
class Progress:
    """The progress of a data set.

    ``items_per_hour`` is over the last ten minutes of work, None before any item has ended. ``of_another_recipe`` counts the
    items that ended under another version of this package, or with other settings, than those of the last run.
    """

    items: dict[str, int]
    stages: list[StageProgress]
    rejected_by_reason: dict[str, int]
    failed_by_reason: dict[str, int]
    items_per_hour: float | None
    left_s: float | None
    cost_usd: float
    cpu_seconds: float
    last_run: str
    of_another_recipe: int


@dataclass(frozen=True)
class ItemStory:
    """The ledger's data on one item."""

    number: int
    item: dict[str, Any]
    twin_id: str | None
    state: str
    reason: str | None
    detail: str
    indexed: bool
    stages: list[StageRow]


def read_progress(
    connection: sqlite3.Connection, at_work: bool, place_of: StageOrder = lambda stage: 0, now: float | None = None
) -> Progress:
    """Return the progress; the ledger may be written at the same time, and ``at_work`` says whether it is.

    ``place_of`` maps a stage's name to its sort key, in the order in which the recipe's stages run.
    """
    now = time.time() if now is None else now
    states = dict.fromkeys(ITEM_STATES, 0)
    states |= dict(connection.execute("SELECT state, count(*) FROM items GROUP BY state").fetchall())
    stages = _stages(connection, place_of)
    run = connection.execute("SELECT * FROM runs ORDER BY run DESC LIMIT 1").fetchone()
    rate = _rate(connection, run, now)
    return Progress(
        items=states,
        stages=stages,
        rejected_by_reason=_by_reason(connection, "rejected"),
        failed_by_reason=_by_reason(connection, "failed"),
        items_per_hour=rate,
        left_s=states["open"] / rate * 3600 if rate else None,
        cost_usd=sum((stage.cost_usd for stage in stages), 0.0),
        cpu_seconds=sum((stage.mean_cpu_seconds * (stage.done + stage.rejected) for stage in stages), 0.0),
        last_run="none" if run is None else run["ended_how"] or ("at work" if at_work else "cut off"),
        of_another_recipe=0 if run is None else _count_other_recipe(connection, run["recipe_sha256"]),
    )


def _stages(connection: sqlite3.Connection, place_of: StageOrder) -> list[StageProgress]:
    rows = connection.execute(
        "SELECT stage, sum(state = 'done') AS done, sum(state = 'running') AS running,"
        " sum(state = 'waiting') AS waiting, sum(state = 'rejected') AS rejected, sum(state = 'failed') AS failed,"
        " coalesce(avg(nullif(seconds, 0)), 0.0) AS mean_seconds,"
        " coalesce(avg(nullif(cpu_seconds, 0)), 0.0) AS mean_cpu_seconds, sum(cost_usd) AS cost_usd"
        " FROM stages GROUP BY stage ORDER BY count(*) DESC, min(at), stage"
    )

    def place(row: StageProgress) -> tuple[int, Any]:
        return (row.stage == ASSEMBLE) - (row.stage == INPUT), place_of(row.stage)

    # stages of another recipe keep the order of the query: each was reached by at most as many items as those before it
    return sorted((StageProgress(**dict(row)) for row in rows), key=place)


def _count_other_recipe(connection: sqlite3.Connection, recipe_sha256: str) -> int:
    (count,) = connection.execute(
        "SELECT count(*) FROM items WHERE state NOT IN ('open', 'duplicate') AND recipe_sha256 <> ?", (recipe_sha256,)
    ).fetchone()
    return int(count)


def _by_reason(connection: sqlite3.Connection, state: str) -> dict[str, int]:
    rows = connection.execute(
        "SELECT reason, count(*) FROM items WHERE state = ? GROUP BY reason ORDER BY 2 DESC, 1", (state,)
    )
    return {row[0] or "unknown": row[1] for row in rows}


def _rate(connection: sqlite3.Connection, run: sqlite3.Row | None, now: float) -> float | None:
    if run is None:
        return None
    until = run["ended_at"] or now
    since = max(run["started_at"], until - RATE_OVER_S)
    (ended,) = connection.execute(
        "SELECT count(*) FROM items WHERE state <> 'open' AND ended_at BETWEEN ? AND ?", (since, until)
    ).fetchone()
    return 3600 * ended / (until - since) if ended and until > since else None


def read_story(connection: sqlite3.Connection, which: str) -> ItemStory:
    """Return the data on an item, found by its number, a prefix of its twin's id, or a substring of its file name.

    Raises UsageError if no item or several items match.
    """
    columns = "number, item, twin_id, state, reason, detail, indexed"
    for condition, value in (
        ("number = ?", which if which.isdigit() and len(which) < 16 else None),
        ("twin_id GLOB ? || '*'", which if set(which) <= set("0123456789abcdef") else None),
        ("instr(item, ?) > 0", json.dumps(which)[1:-1]),
    ):
        if value is None:
            continue
        rows = connection.execute(f"SELECT {columns} FROM items WHERE {condition} LIMIT 6", (value,)).fetchall()
        if len(rows) > 1:
            near = "; ".join(
                f"{row['number']} {row['twin_id'] or ''} {describe_payload(json.loads(row['item']))}" for row in rows
            )
            raise UsageError(f"{which}: matches several items: {near}; give the number or id of one")
        if rows:
            row = rows[0]
            return ItemStory(
                row["number"], json.loads(row["item"]), row["twin_id"], row["state"], row["reason"], row["detail"],
                bool(row["indexed"]), stage_rows(connection, row["number"]),
            )  # fmt: skip
    raise UsageError(f"{which}: no such item; give an item number, a twin id, or part of a file name")


def describe_payload(payload: Mapping[str, Any]) -> str:
    """Return a payload as one readable line."""
    return ", ".join(f"{key} {value}" for key, value in payload.items() if value is not None)


UnacceptedState = Literal["rejected", "failed", "waiting"]


@dataclass(frozen=True)
class Unaccepted:
    """An item that was not accepted: ``which`` is its number, ``reason`` a code, ``message`` a description.

    An error message starts with the exception's class, preceded by the stage and the attempts where known. ``waiting`` items
    are open and were waiting for a service when the run ended.
    """

    which: str
    state: UnacceptedState
    reason: str | None
    message: str


def read_unaccepted(connection: sqlite3.Connection) -> Iterator[Unaccepted]:
    """Yield rejected and failed items, then waiting ones."""
    for row in connection.execute(
        "SELECT number, state, reason, detail FROM items WHERE state IN ('rejected', 'failed') ORDER BY number"
    ):
        yield Unaccepted(str(row["number"]), row["state"], row["reason"], row["detail"])
    for row in connection.execute(
        "SELECT s.number, s.error FROM stages s JOIN items i ON i.number = s.number"
        " WHERE i.state = 'open' AND s.state = 'waiting' AND s.error IS NOT NULL ORDER BY s.number"
    ):
        yield Unaccepted(str(row["number"]), "waiting", None, row["error"])


def read_items(connection: sqlite3.Connection) -> Iterator[ItemRow]:
    """Yield all items by number."""
    rows = connection.execute(
        "SELECT number, item, coalesce(twin_id, ''), state, reason, CASE state WHEN 'open' THEN coalesce((SELECT error FROM"
        " stages s WHERE s.number = i.number AND s.state = 'waiting' ORDER BY at DESC LIMIT 1), '') ELSE detail END"
        " FROM items i ORDER BY number"
    )
    for number, payload, *said in rows:
        yield ItemRow(number, json.loads(payload), *said)


def stage_rows(connection: sqlite3.Connection, number: int) -> list[StageRow]:
    """Return the stages of one item, ordered by their last change."""
    columns = "stage, key, state, attempts, seconds, cpu_seconds, cost_usd, error"
    rows: list[Any] = connection.execute(
        f"SELECT {columns} FROM stages WHERE number = ? ORDER BY at", (number,)
    ).fetchall()
    return [StageRow(**dict(zip(columns.split(", "), row, strict=True))) for row in rows]
