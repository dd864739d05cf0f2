"""Incremental writing of the index, and merging of its parts. Every twin is in exactly one part, so readers need no joins.

A part is written file by file and becomes valid once ``parts.json`` lists it. A crash at any time leaves either the old or the
new list. Unlisted files are ignored and removed by the next write. There is a single writer: worker processes call one after the
other, never concurrently, so nothing is locked here. Readers may read during a write: the files of the previous list stay until
the next write.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from math import ceil, log
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from pyarrow.fs import FSSpecHandler, LocalFileSystem, PyFileSystem

from manitwin.dataset.index.part_list import (
    INDEX,
    IndexPart,
    PartList,
    read_part_list,
    remove_unused_files,
    require_files,
    sort_parts,
)
from manitwin.dataset.index.rows import FILES, rows_of
from manitwin.dataset.index.tables import TABLES, concatenate_tables, parquet
from manitwin.dataset.index.twins import local_files
from manitwin.errors import UsageError
from manitwin.formats.printable import printable_line
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import RECORD

MERGE_WIDTH = 8
"""Number of parts of similar size that are merged into one. A twin among n is then written log8(n) times, and readers open few
files.
"""

PART_ROWS = 1 << 20
"""Approximate number of grasps of a merged part: 60 MB on disk, 0.6 GB of memory to sort."""

LOG = logging.getLogger("manitwin.index")

Files = Mapping[str, Sequence[str]]
"""Files of each table, as named by the file system."""


class IndexTables:
    """The index tables that a run maintains for its twins."""

    def add(self, root: DatasetRoot, ids: Sequence[str]) -> None:
        """Index finished twins, new or rebuilt, as one more part, and remove twins whose folder is gone."""
        there = [twin_id for twin_id in ids if root.exists(f"{root.twin_name(twin_id)}/{RECORD}")]
        write_part(root, there, gone=[twin_id for twin_id in ids if twin_id not in there])

    def merge(self, root: DatasetRoot) -> None:
        """Merge all parts into a few large ones."""
        compact(root)

    def heal(self, root: DatasetRoot) -> bool:
        """Remove an unreadable index; return True if there is no index (any more), so that all twins must be added."""
        try:
            parts = read_part_list(root)
            if parts is None:
                return True
            require_files(root, parts)
        except UsageError as error:
            LOG.warning("the index is written anew: %s", error)
            root.remove(INDEX)
            return True
        return False


def write_part(root: DatasetRoot, ids: Iterable[str], *, gone: Iterable[str] = ()) -> IndexPart | None:
    """Index finished twins, new or rebuilt, as one more part and return it; return None if no ids are given.

    Twins that an older part has, and those in ``gone``, are removed from that part, which is rewritten under another name. Eight
    parts of similar size are then merged into one, so the returned part may already be part of a larger one. Raises TwinError for
    a folder that cannot be read; the index is then unchanged.
    """
    wanted = sorted(set(ids))
    changed = sorted({*wanted, *gone})
    before = read_part_list(root) or PartList()
    remove_unused_files(root, before)
    if not changed:
        return None
    writer = _Writer(root, before)
    older = writer.parts_with(changed)
    part = writer.add(_concatenate_rows(rows_of_twins(root, wanted))) if wanted else None
    for each in older:
        writer.replace([each], without=frozenset(changed))
    while alike := _mergeable_parts(writer.parts):
        writer.replace(alike)
    writer.finish()
    return part


def compact(root: DatasetRoot) -> list[IndexPart]:
    """Merge all parts into a few large ones that do not overlap and return them; a compact index stays unchanged."""
    before = read_part_list(root) or PartList()
    remove_unused_files(root, before)
    if _is_compact(before):
        return list(before.parts)
    writer = _Writer(root, before)
    writer.replace(list(before.parts))
    after = writer.finish()
    remove_unused_files(root, after)
    return list(after.parts)


def indexed_twins(root: DatasetRoot) -> dict[str, str]:
    """Return a dict from the id of every twin in the index to its revision; empty if there is no index."""
    parts = read_part_list(root) or PartList()
    require_files(root, parts)
    files, fs = files_of(root, parts.parts), file_system(root)
    found: dict[str, str] = {}
    for table in ("twins", "rejections") if parts.parts else ():
        rows = read_rows(files, table, fs, columns=["twin_id", "revision"])
        found |= dict(zip(rows["twin_id"].to_pylist(), rows["revision"].to_pylist(), strict=True))
    return found


def rows_of_twins(root: DatasetRoot, ids: Iterable[str]) -> Iterator[dict[str, pa.Table]]:
    """Yield the rows of finished twins of a data set, one twin at a time; raises TwinError."""
    for twin_id in ids:
        with local_files(root, twin_id, FILES) as folder:
            yield rows_of(folder)


def _concatenate_rows(rows: Iterator[dict[str, pa.Table]]) -> dict[str, pa.Table]:
    each = list(rows)
    return {table: concatenate_tables(table, [tables[table] for tables in each]) for table in TABLES}


def _is_compact(parts: PartList) -> bool:
    """Return whether the parts do not overlap and are as few as a merge would make them."""
    ordered = parts.parts
    apart = all(one.last < other.first for one, other in pairwise(ordered))
    return apart and len(ordered) <= max(1, -(-parts.rows("grasps") // PART_ROWS))


def _mergeable_parts(parts: Sequence[IndexPart]) -> list[IndexPart]:
    """Return parts of similar size if there are enough of them to merge; full parts are left alone."""
    by_size: dict[int, list[IndexPart]] = {}
    for part in parts:
        if part.rows["grasps"] < PART_ROWS // 2:
            by_size.setdefault(int(log(sum(part.rows.values()), MERGE_WIDTH)), []).append(part)
    return next((alike for alike in by_size.values() if len(alike) >= MERGE_WIDTH), [])


class _Writer:
    """The parts of an index while they change; nothing becomes valid before ``finish``."""

    def __init__(self, root: DatasetRoot, before: PartList):
        require_files(root, before)
        self.root, self.fs = root, file_system(root)
        self.parts, self.next = list(before.parts), before.next

    def parts_with(self, ids: list[str]) -> list[IndexPart]:
        """Return the parts that contain any of the sorted ids."""
        near = [part for part in self.parts if part.first <= ids[-1] and ids[0] <= part.last] if ids else []
        wanted = set(ids)
        return [part for part in near if not wanted.isdisjoint(twin_ids(files_of(self.root, [part]), self.fs).tolist())]

    def add(self, rows: dict[str, pa.Table]) -> IndexPart:
        """Write rows as a new part and return it."""
        part = write_rows(self.root, self.next, rows)
        self.parts.append(part)
        self.next += 1
        return part

    def replace(self, parts: list[IndexPart], without: frozenset[str] = frozenset()) -> None:
        """Rewrite the rows of parts, merged, without the rows of some twins."""
        grasps = sum(part.rows["grasps"] for part in parts)
        for rows in merge_rows(files_of(self.root, parts), self.fs, grasps, without=without):
            self.add(rows)
        self.parts = [part for part in self.parts if part not in parts]

    def finish(self) -> PartList:
        """Make these parts the index."""
        after = PartList(sort_parts(self.parts), self.next)
        after.write(self.root)
        return after


def file_system(root: DatasetRoot) -> Any:
    """Return a data set's file system as a pyarrow file system."""
    return LocalFileSystem() if root.local is not None else PyFileSystem(FSSpecHandler(root.fs))


def files_of(root: DatasetRoot, parts: Sequence[IndexPart]) -> Files:
    """Return the files of parts, keyed by table."""
    return {table: [root.full(part.file(table)) for part in parts] for table in TABLES}


def read_rows(files: Files, table: str, fs: Any, *, columns: list[str] | None = None, where: Any = None) -> pa.Table:
    """Return the rows of a table's files that satisfy a pyarrow expression; raises UsageError if they cannot be read."""
    import pyarrow.dataset as pads  # imports pandas; few users of this module read rows

    try:
        source = pads.dataset(list(files[table]), schema=TABLES[table], format="parquet", filesystem=fs)
        return source.to_table(columns=columns, filter=where)
    except (pa.ArrowException, OSError) as error:
        cause = printable_line(str(error).split("\n")[0], max_characters=160)
        raise UsageError(f"table {table} of the index cannot be read ({cause}); run manitwin check DATASET") from error


def twin_ids(files: Files, fs: Any) -> np.ndarray:
    """Return the sorted ids of all twins in the files."""
    both = [read_rows(files, table, fs, columns=["twin_id"])["twin_id"] for table in ("twins", "rejections")]
    return np.sort(np.concatenate([column.to_numpy(zero_copy_only=False).astype(str) for column in both]))


def merge_rows(
    files: Files, fs: Any, grasps: int, *, without: frozenset[str] = frozenset()
) -> Iterator[dict[str, pa.Table]]:
    """Yield the rows of all files, except those of the twins ``without``, by table, in id ranges that do not overlap.

    ``grasps`` is the total number of grasps and determines the number of ranges.
    """
    ids = twin_ids(files, fs)
    ids = ids[~np.isin(ids, sorted(without))]
    if not len(ids):
        return
    count = min(max(1, ceil(grasps / PART_ROWS)), len(ids))
    for chunk in np.array_split(ids, count):
        within = (pc.field("twin_id") >= str(chunk[0])) & (pc.field("twin_id") <= str(chunk[-1]))
        if without:
            within &= ~pc.field("twin_id").isin(sorted(without))
        yield {table: concatenate_tables(table, [read_rows(files, table, fs, where=within)]) for table in TABLES}


def write_rows(root: DatasetRoot, number: int, rows: Mapping[str, pa.Table]) -> IndexPart:
    """Write the tables of a part, each file atomically; the part becomes valid once the list of parts names it."""
    ids = [twin_id for table in ("twins", "rejections") for twin_id in rows[table]["twin_id"].to_pylist()]
    part = IndexPart(f"{number:06d}", {table: len(rows[table]) for table in TABLES}, min(ids), max(ids))
    for table in TABLES:
        root.write_bytes(part.file(table), parquet(rows[table]))
    return part
