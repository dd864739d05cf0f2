"""Attempted episodes: the rows of the table of attempts, which batches write in parts and a run merges; and their counts."""

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
from manitwin.twin.store import file_beside

OUTCOMES = (
    "kept", "unplanned_contact", "disturbed", "misplaced", "toppled", "goal_missed", "dropped", "not_lifted", "replan_failed",
    "unsettled", "reached_already", "no_grasp", "no_plan", "no_room",
)  # fmt: skip
"""``kept`` succeeded and touched nothing by accident; ``unplanned_contact`` and ``disturbed`` (another object moved by more than
1 cm or 5 degrees) succeeded otherwise; from ``misplaced`` to ``replan_failed`` the execution failed; ``unsettled`` is a start
that did not stand, ``reached_already`` one of which the goal was true, ``no_room`` one that could not be set up; ``no_grasp``
(the twin has none for the robot's hand) and ``no_plan`` were never executed. ``goal_missed``: the skill's goal is not true at
the end; ``failure`` says what of it."""

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
"""The columns of a batch: the fields of Attempt."""

MERGED_SCHEMA = SCHEMA.append(pa.field("episode_index", pa.int64()))
"""``episode_index`` is the number of a kept attempt's trajectory in the merged file, null for those that were not kept."""

_ROW_GROUP = 1 << 16


@dataclass(frozen=True)
class Attempt:
    """One row; errors are of the released object at rest against the goal that was asked for. None: never got there.

    ``plan_failures`` is JSON: how many candidate grasps failed of what. ``goal`` is the skill's goal in words (pick_place: None),
    ``failure`` the first literal of it that is not true, ``measured`` JSON: every literal with what was measured.
    ``task_id`` is that of a task, None for episodes that were drawn.
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
        """True where a plan was found, so that it was executed."""
        return self.outcome not in NEVER_EXECUTED

    @property
    def succeeded(self) -> bool:
        """True where the object stands where it should, whatever was touched on the way."""
        return self.outcome in ("kept", "unplanned_contact", "disturbed")


def attempt_from(said: dict[str, Any]) -> Attempt:
    """Return the attempt of a dict with its fields; raises EpisodesError where one is missing or unknown."""
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
    """Write attempts as a Parquet file, which appears whole or not at all; equal attempts give equal bytes."""
    with file_beside(path) as beside:
        pq.write_table(attempts_table(attempts), beside, compression="zstd", version="2.6")


def read_attempts(path: Path) -> Iterator[Attempt]:
    """Yield the attempts of a file in order; raises EpisodesError for a file that is no table of attempts."""
    for rows in read_tables(path):
        for row in rows.select(SCHEMA.names).to_pylist():
            yield attempt_from(row)


def read_tables(path: Path) -> Iterator[pa.Table]:
    """Yield the rows of a file, a row group at a time, with the columns of ``SCHEMA`` first."""
    with open_parquet(path, EpisodesError, schema=SCHEMA, remedy=REMEDY, inside=path.parent) as file:
        for group in range(file.row_groups):
            yield file.read(SCHEMA.names, row_group=group)


def merge_attempts(files: Iterable[Path], place: Path) -> tuple[int, int]:
    """Write all rows of all files in order as one file, with ``episode_index``; return how many rows, and how many kept.

    Kept attempts are numbered as they come, which is how ``hdf5_merge.merge_episodes`` numbers the trajectories of the
    same batches. A row group's worth of rows is in memory at a time.
    """
    rows = kept = waiting = 0
    buffer: list[pa.Table] = []
    with (
        file_beside(place) as beside,
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
class Tally:
    """Counts of attempts by how far they came."""

    attempted: int = 0
    executed: int = 0
    succeeded: int = 0
    kept: int = 0

    def add(self, attempt: Attempt) -> None:
        """Count an attempt by how far it came."""
        self.attempted += 1
        self.executed += attempt.planned
        self.succeeded += attempt.succeeded
        self.kept += attempt.outcome == "kept"


@dataclass(frozen=True)
class Success:
    """Attempts in all, by category and by outcome, and the objects (id, category) that never succeeded.

    ``plan_failures``: of attempts without a plan, what grasps failed of, frequent reasons first. ``without_grasp``: the objects
    that have no grasp for the hand. ``transferred``: attempts with a grasp that was verified for other jaws.
    """

    total: Tally = field(default_factory=Tally)
    by_category: Mapping[str, Tally] = field(default_factory=dict)
    outcomes: Mapping[str, int] = field(default_factory=dict)
    never: tuple[tuple[str, str], ...] = ()
    plan_failures: Mapping[str, int] = field(default_factory=dict)
    without_grasp: tuple[tuple[str, str], ...] = ()
    transferred: int = 0


def _frequent_first(counted: Counter[str]) -> dict[str, int]:
    return dict(sorted(counted.items(), key=lambda item: (-item[1], item[0])))


def success_of(attempts: Iterable[Attempt]) -> Success:
    """Return the counts of attempts, in all and by category and outcome."""
    total, by_category, outcomes = Tally(), dict[str, Tally](), Counter[str]()
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
            by_category.setdefault(attempt.category, Tally()).add(attempt)
            categories.setdefault(attempt.twin_id, attempt.category)
            if attempt.succeeded:
                successful.add(attempt.twin_id)
    return Success(
        total,
        dict(sorted(by_category.items())),
        _frequent_first(outcomes),
        tuple(sorted((each, name) for each, name in categories.items() if each not in successful)),
        _frequent_first(failures),
        tuple(sorted(without_grasp)),
        transferred,
    )
