"""Put rows of many files together into few large parts, sorted by twin: one range of ids at a time in memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import ceil
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.dataset as pads
from pyarrow.fs import FSSpecHandler, LocalFileSystem, PyFileSystem

from manitwin.dataset.index.part_list import IndexPart
from manitwin.dataset.index.tables import TABLES, joined, parquet
from manitwin.twin.dataset_root import DatasetRoot

PART_ROWS = 1 << 20
"""Grasps of a merged part, about: 60 MB on disk, 0.6 GB of memory to sort."""

Files = Mapping[str, Sequence[str]]
"""The files to read of each table, as the file system names them."""


def file_system(root: DatasetRoot) -> Any:
    """Return a data set's file system as pyarrow takes it."""
    return LocalFileSystem() if root.local is not None else PyFileSystem(FSSpecHandler(root.fs))


def files_of(root: DatasetRoot, parts: Sequence[IndexPart]) -> Files:
    """Return the files of parts by table."""
    return {table: [root.full(part.file(table)) for part in parts] for table in TABLES}


def read_rows(files: Files, table: str, fs: Any, *, columns: list[str] | None = None, where: Any = None) -> pa.Table:
    """Return the rows of a table's files that satisfy a pyarrow expression."""
    source = pads.dataset(list(files[table]), schema=TABLES[table], format="parquet", filesystem=fs)
    return source.to_table(columns=columns, filter=where)


def twin_ids(files: Files, fs: Any) -> np.ndarray:
    """Return the ids of all twins in the files, sorted."""
    both = [read_rows(files, table, fs, columns=["twin_id"])["twin_id"] for table in ("twins", "rejections")]
    return np.sort(np.concatenate([column.to_numpy(zero_copy_only=False).astype(str) for column in both]))


def merged(
    files: Files, fs: Any, grasps: int, *, without: frozenset[str] = frozenset()
) -> Iterator[dict[str, pa.Table]]:
    """Yield the rows of all files but those of the twins ``without``, by table, in ranges of ids that do not overlap.

    ``grasps`` is how many grasps there are: it decides how many ranges there will be.
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
        yield {table: joined(table, [read_rows(files, table, fs, where=within)]) for table in TABLES}


def write_rows(root: DatasetRoot, number: int, rows: Mapping[str, pa.Table]) -> IndexPart:
    """Write the tables of a part, each file whole; the part counts from when the list of parts names it."""
    ids = [twin_id for table in ("twins", "rejections") for twin_id in rows[table]["twin_id"].to_pylist()]
    part = IndexPart(f"{number:06d}", {table: len(rows[table]) for table in TABLES}, min(ids), max(ids))
    for table in TABLES:
        root.write_bytes(part.file(table), parquet(rows[table]))
    return part
