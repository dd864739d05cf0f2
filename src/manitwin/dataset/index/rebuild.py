"""Parallel rebuild of the whole index from the twin folders."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from pebble import ProcessExpired
from pyarrow.fs import LocalFileSystem

from manitwin.dataset.index.part_list import INDEX, IndexPart, PartList, no_dataset, remove_unused_files, sort_parts
from manitwin.dataset.index.parts import merge_rows, rows_of_twins, write_rows
from manitwin.dataset.index.tables import TABLES, concatenate_tables, parquet
from manitwin.engine.worker_pool import WorkerPool
from manitwin.engine.worker_processes import hidden_main_module
from manitwin.errors import TwinError
from manitwin.twin.dataset_root import DatasetRoot

CHUNK = 64
"""Twins per task: a few seconds of work and a few thousand rows."""


@dataclass(frozen=True)
class Rebuilt:
    """The parts of a new index, and one line for each twin folder that could not be read and is therefore not indexed."""

    parts: list[IndexPart]
    unreadable: list[str]

    def rows(self, table: str) -> int:
        """Return the number of rows of a table."""
        return sum(part.rows[table] for part in self.parts)


@dataclass(frozen=True)
class _ReadResult:
    """Result of a task; its rows are in files."""

    twins: int
    grasps: int
    unreadable: list[str]


def rebuild(
    root: DatasetRoot,
    *,
    jobs: int,
    on_start: Callable[[int], None] = lambda twins: None,
    on_read: Callable[[int], None] = lambda twins: None,
) -> Rebuilt:
    """Replace a data set's index by one made from its folders, with the same rows as an index written during a run.

    ``on_start`` receives the number of twins, ``on_read`` how many more have been read. The old index stays valid until the new
    one is complete. Raises UsageError if there are no twins, and TwinError if a worker process dies; nothing has changed then.
    """
    if not root.has_twins:
        raise no_dataset(root)
    ids = list(root.twin_ids())
    on_start(len(ids))
    chunks = [ids[start : start + CHUNK] for start in range(0, len(ids), CHUNK)]
    parts: list[IndexPart] = []
    unreadable: list[str] = []
    number = _first_unused_number(root)
    with hidden_main_module(), tempfile.TemporaryDirectory(prefix="manitwin-index-") as scratch:
        grasps = 0
        for read in _read_all(root, chunks, Path(scratch), jobs):
            unreadable += read.unreadable
            grasps += read.grasps
            on_read(read.twins)
        files = {table: sorted(map(str, Path(scratch).glob(f"{table}-*.parquet"))) for table in TABLES}
        for rows in merge_rows(files, LocalFileSystem(), grasps) if files["twins"] else ():
            parts.append(write_rows(root, number + len(parts), rows))
    after = PartList(sort_parts(parts), number + len(parts))
    after.write(root)
    remove_unused_files(root, after)
    return Rebuilt(parts, sorted(unreadable))


def _first_unused_number(root: DatasetRoot) -> int:
    """Return a number above those of all index files, since the old list may be lost or of another version."""
    stems = (PurePosixPath(name).stem for name in root.names_below(INDEX))
    return max((int(stem) + 1 for stem in stems if stem.isdecimal()), default=0)


def _read_all(root: DatasetRoot, chunks: list[list[str]], scratch: Path, jobs: int) -> Iterator[_ReadResult]:
    pool = WorkerPool(jobs)
    try:
        futures = [pool.schedule(_read, (root, chunk, scratch, number)) for number, chunk in enumerate(chunks)]
        for chunk, future in zip(chunks, futures, strict=True):
            try:
                yield pool.result(future)
            except ProcessExpired as error:
                raise TwinError(
                    f"{root.url}: a process died (exit code {error.exitcode}) while it read twins {chunk[0]} to {chunk[-1]}; "
                    f"run manitwin check {root.url}"
                ) from error
    finally:
        pool.stop()


def _read(root: DatasetRoot, ids: list[str], scratch: Path, number: int) -> _ReadResult:
    """Write the rows of twins to files in the scratch folder; runs in a worker process."""
    each = []
    unreadable = []
    for twin_id in ids:
        try:
            each += list(rows_of_twins(root, [twin_id]))
        except TwinError as error:
            unreadable.append(str(error))
    grasps = sum(len(rows["grasps"]) for rows in each)
    for table in TABLES:
        content = parquet(concatenate_tables(table, [rows[table] for rows in each]))
        (scratch / f"{table}-{number:06d}.parquet").write_bytes(content)
    return _ReadResult(len(ids), grasps, unreadable)
