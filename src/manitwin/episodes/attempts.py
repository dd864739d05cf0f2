"""Table of attempted episodes: rows that batches write and a run merges, and their counts."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.errors import EpisodesError
from manitwin.formats.parquet_file import open_parquet
from manitwin.twin.store import atomic_file

OUTCOMES = (
    "kept", "unplanned_contact", "disturbed", "misplaced", "toppled", "goal_missed", "dropped", "not_lifted", "replan_failed",
    "unsettled", "reached_already", "no_grasp", "no_plan", "no_room",
)  # fmt: skip
"""``kept``: succeeded without unplanned contact. ``unplanned_contact`` and ``disturbed`` (another object moved by more than 1
cm or 5 degrees) otherwise succeeded. From ``misplaced`` to ``replan_failed`` the execution failed. Never executed:
``unsettled`` (the start was not stable), ``reached_already`` (the goal was true at the start), ``no_grasp`` (the twin has
none for the robot's hand), ``no_plan``, and ``no_room`` (the scene could not be set up). ``goal_missed``: the skill's goal is
not true at the end; ``failure`` names the literal.
"""

NEVER_EXECUTED = ("unsettled", "reached_already", "no_grasp", "no_plan", "no_room")
EXECUTION_FAILURES = ("misplaced", "toppled", "goal_missed", "dropped", "not_lifted", "replan_failed")

ATTEMPTS = "attempts.parquet"
REMEDY = "make the episodes again in a new folder; those of an earlier version are read by the version that made them"
_TEXT, _REAL, _COUNT, _FLAG = pa.string(), pa.float64(), pa.int32(), pa.bool_()

SCHEMA = pa.schema(
    [
        ("episode_id", _TEXT),
        ("robot", _TEXT),
        ("skill", _TEXT),
        ("twin_id", _TEXT),
        ("category", _TEXT),
        ("scene_id", _TEXT),
        ("seed", pa.int64()),
        ("others", _COUNT),
        ("outcome", _TEXT),
        ("grasp_id", _TEXT),
        ("grasp_type", _TEXT),
        ("transferred", _FLAG),
        ("grasps_tried", _COUNT),
        ("plan_failures", _TEXT),
        ("position_error_m", _REAL),
        ("tilt_rad", _REAL),
        ("yaw_error_rad", _REAL),
        ("slip_m", _REAL),
        ("length_s", _REAL),
        ("instructions", pa.list_(_TEXT)),
        ("goal", _TEXT),
        ("failure", _TEXT),
        ("measured", _TEXT),
        ("task_id", _TEXT),
    ]
)
"""Columns of a batch's table: the fields of Attempt."""

MERGED_SCHEMA = SCHEMA.append(pa.field("episode_index", pa.int64()))
"""``episode_index`` is the number of a kept attempt's trajectory in the merged file, null for other attempts."""

_ROW_GROUP = 1 << 16


@dataclass(frozen=True)
class Attempt:
    """One row. Errors compare the released object at rest with the requested goal; None if the episode did not get there.

    ``plan_failures`` is JSON: numbers of failed candidate grasps by reason. ``goal`` is the skill's goal as text (None for
    pick_place), ``failure`` its first literal that is not true, ``measured`` JSON: every literal with its measurements.
    ``task_id`` is None for episodes without a task.
    """

    episode_id: str
    robot: str
    skill: str
    twin_id: str
    category: str
    scene_id: str | None
    seed: int
    others: int
    outcome: str
    grasp_id: str | None
    grasp_type: str | None
    transferred: bool
    grasps_tried: int
    plan_failures: str
    position_error_m: float | None
    tilt_rad: float | None
    yaw_error_rad: float | None
    slip_m: float | None
    length_s: float | None
    instructions: tuple[str, ...]
    goal: str | None = None
    failure: str | None = None
    measured: str | None = None
    task_id: str | None = None

    @property
    def planned(self) -> bool:
        """True if a plan was found and executed."""
        return self.outcome not in NEVER_EXECUTED

    @property
    def succeeded(self) -> bool:
        """True if the goal was reached, regardless of unplanned contacts."""
        return self.outcome in ("kept", "unplanned_contact", "disturbed")


def attempt_from(said: dict[str, Any]) -> Attempt:
    """Return the attempt given by a dict of its fields; raises EpisodesError if one is missing or unknown."""
    try:
        return Attempt(**{**said, "instructions": tuple(said["instructions"])})
    except (TypeError, KeyError) as error:
        raise EpisodesError(f"an attempt has other fields than in this version ({error}); {REMEDY}") from error


def attempts_table(attempts: Iterable[Attempt]) -> pa.Table:
    """Return attempts as rows; raises EpisodesError for an unknown outcome."""
    rows = [asdict(attempt) for attempt in attempts]
    for row in rows:
        if row["outcome"] not in OUTCOMES:
            valid = ", ".join(OUTCOMES)
            raise EpisodesError(f"episode {row['episode_id']}: unknown outcome {row['outcome']!r}; valid: {valid}")
    return pa.Table.from_pylist(rows, schema=SCHEMA)


def write_attempts(path: Path, attempts: Iterable[Attempt]) -> None:
    """Write attempts as a Parquet file, atomically and deterministically."""
    with atomic_file(path) as beside:
        pq.write_table(attempts_table(attempts), beside, compression="zstd", version="2.6")


def read_attempts(path: Path) -> Iterator[Attempt]:
    """Yield the attempts of a file in order; raises EpisodesError for a file that is not a table of attempts."""
    for rows in read_tables(path):
        for row in rows.select(SCHEMA.names).to_pylist():
            yield attempt_from(row)


def read_tables(path: Path) -> Iterator[pa.Table]:
    """Yield the rows of a file, one row group at a time, with the columns of ``SCHEMA``."""
    with open_parquet(path, EpisodesError, schema=SCHEMA, remedy=REMEDY, inside=path.parent) as file:
        for group in range(file.row_groups):
            yield file.read(SCHEMA.names, row_group=group)


def merge_attempts(files: Iterable[Path], place: Path) -> tuple[int, int]:
    """Write the rows of all files in order into one file, with ``episode_index``; return the numbers of rows and kept rows.

    Kept attempts are numbered in order, as ``hdf5_merge.merge_episodes`` numbers the trajectories of the same batches. About
    one row group is in memory at a time.
    """
    rows = kept = waiting = 0
    buffer: list[pa.Table] = []
    with (
        atomic_file(place) as beside,
        pq.ParquetWriter(beside, MERGED_SCHEMA, compression="zstd", version="2.6") as writer,
    ):
        for path in files:
            for table in read_tables(path):
                numbered, kept = _numbered(table, kept)
                buffer.append(numbered)
                rows, waiting = rows + len(table), waiting + len(table)
                while waiting >= _ROW_GROUP:
                    whole = pa.concat_tables(buffer).combine_chunks()
                    writer.write_table(whole.slice(0, _ROW_GROUP))
                    buffer, waiting = [whole.slice(_ROW_GROUP)], waiting - _ROW_GROUP
        writer.write_table(pa.concat_tables([MERGED_SCHEMA.empty_table(), *buffer]).combine_chunks())
    return rows, kept


def _numbered(table: pa.Table, kept: int) -> tuple[pa.Table, int]:
    numbers: list[int | None] = []
    for outcome in table["outcome"].to_pylist():
        numbers.append(kept if outcome == "kept" else None)
        kept += outcome == "kept"
    rows = table.select(SCHEMA.names).cast(SCHEMA)
    return rows.append_column(MERGED_SCHEMA.field("episode_index"), pa.array(numbers, pa.int64())), kept


@dataclass
class StageCounts:
    """Counts of attempts by the stage they reached."""

    attempted: int = 0
    executed: int = 0
    succeeded: int = 0
    kept: int = 0

    def add(self, attempt: Attempt) -> None:
        """Count an attempt."""
        self.attempted += 1
        self.executed += attempt.planned
        self.succeeded += attempt.succeeded
        self.kept += attempt.outcome == "kept"


@dataclass(frozen=True)
class AttemptCounts:
    """Counts of attempts in total, by category and by outcome, and the objects (id, category) that never succeeded.

    ``plan_failures``: for attempts without a plan, failure reasons of grasps, frequent ones first. ``without_grasp``: objects
    without a grasp for the hand. ``transferred``: number of attempts with a grasp verified for other jaws.
    """

    total: StageCounts = field(default_factory=StageCounts)
    by_category: Mapping[str, StageCounts] = field(default_factory=dict)
    outcomes: Mapping[str, int] = field(default_factory=dict)
    never: tuple[tuple[str, str], ...] = ()
    plan_failures: Mapping[str, int] = field(default_factory=dict)
    without_grasp: tuple[tuple[str, str], ...] = ()
    transferred: int = 0


def _frequent_first(counted: Counter[str]) -> dict[str, int]:
    return dict(sorted(counted.items(), key=lambda item: (-item[1], item[0])))


def count_attempts(attempts: Iterable[Attempt]) -> AttemptCounts:
    """Return the counts of attempts, in total and by category and outcome."""
    total, by_category, outcomes = StageCounts(), dict[str, StageCounts](), Counter[str]()
    categories, successful = dict[str, str](), set[str]()
    failures, without_grasp, transferred = Counter[str](), set[tuple[str, str]](), 0
    for attempt in attempts:
        transferred += attempt.transferred
        total.add(attempt)
        outcomes[attempt.outcome] += 1
        if attempt.outcome == "no_plan":
            failures.update(json.loads(attempt.plan_failures))
        elif attempt.outcome == "no_grasp":
            without_grasp.add((attempt.twin_id, attempt.category))
        if attempt.twin_id:
            by_category.setdefault(attempt.category, StageCounts()).add(attempt)
            categories.setdefault(attempt.twin_id, attempt.category)
            if attempt.succeeded:
                successful.add(attempt.twin_id)
    return AttemptCounts(
        total,
        dict(sorted(by_category.items())),
        _frequent_first(outcomes),
        tuple(sorted((each, name) for each, name in categories.items() if each not in successful)),
        _frequent_first(failures),
        tuple(sorted(without_grasp)),
        transferred,
    )
