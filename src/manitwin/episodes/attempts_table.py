"""attempts.parquet: one row for every attempt, kept or not."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.episodes.attempt import OUTCOMES, Attempt
from manitwin.episodes.beside import file_beside
from manitwin.episodes.stored_episode import attempt_from
from manitwin.errors import EpisodesError

ATTEMPTS = "attempts.parquet"
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
    ]
)
"""The columns of a batch: the fields of Attempt."""

MERGED_SCHEMA = SCHEMA.append(pa.field("episode_index", pa.int64()))
"""``episode_index`` is the number of a kept attempt's trajectory in the merged file, null for those that were not kept."""

_ROW_GROUP = 1 << 16


def attempts_table(attempts: Iterable[Attempt]) -> pa.Table:
    """Return attempts as rows; raises EpisodesError for an unknown outcome."""
    rows = [asdict(attempt) for attempt in attempts]
    for row in rows:
        if row["outcome"] not in OUTCOMES:
            valid = ", ".join(OUTCOMES)
            raise EpisodesError(f"episode {row['episode_id']}: unknown outcome {row['outcome']!r}. Valid: {valid}")
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
    try:
        with pq.ParquetFile(path) as file:
            missing = [name for name in SCHEMA.names if name not in file.schema_arrow.names]
            if missing:
                raise EpisodesError(f"{path}: has no column {missing[0]}; run the episodes again")
            for group in range(file.num_row_groups):
                yield file.read_row_group(group)
    except (OSError, pa.ArrowInvalid) as error:
        raise EpisodesError(f"{path}: no Parquet file that can be read ({error}); run the episodes again") from error


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
