"""Published tables: the index tables restricted to the published twins, with the shard of each twin."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import pyarrow as pa

from manitwin.dataset.index.part_list import PartList, no_index, read_part_list, require_files
from manitwin.dataset.index.parts import file_system, files_of, merge_rows, read_rows
from manitwin.dataset.index.tables import TABLES
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot

PUBLISHED = ("twins", "points", "grasps", "placements")
"""Published tables. Rejections and stage costs are not published: they describe the run, and their texts may name local files."""

INDEX = "index"
SHARDS_FILE = f"{INDEX}/shards-00000.parquet"

SHARDS = pa.schema(
    [
        ("shard", pa.string()),
        ("twins", pa.int32()),
        ("bytes", pa.int64()),
        ("sha256", pa.string()),
        ("contents_sha256", pa.string()),
    ]
)


def parts_of_index(root: DatasetRoot, finished: set[str]) -> PartList:
    """Return the parts of a data set's index; raises UsageError if its twins are not exactly the finished ones."""
    parts = read_part_list(root)
    if parts is None or not parts.parts:
        raise no_index(root)
    require_files(root, parts)
    indexed = {
        row["twin_id"] for table in ("twins", "rejections") for row in rows_of_table(root, parts, table, ["twin_id"])
    }
    if indexed != finished:
        raise UsageError(
            f"{root.url}: its index lacks {len(finished - indexed):,} finished twins and has "
            f"{len(indexed - finished):,} that are missing; run manitwin index {root.url} and check what it cannot read"
        )
    return parts


def rows_of_table(root: DatasetRoot, parts: PartList, table: str, columns: list[str]) -> list[dict[str, Any]]:
    """Return some columns of all rows of a table, unordered."""
    rows = read_rows(files_of(root, parts.parts), table, file_system(root), columns=columns)
    found: list[dict[str, Any]] = rows.to_pylist()
    return found


def published_rows(
    root: DatasetRoot, parts: PartList, shard_of: Mapping[str, str], kept_back: frozenset[str]
) -> Iterator[dict[str, pa.Table]]:
    """Yield the rows of the published tables, sorted by twin, about a million grasps at a time.

    ``shard_of`` maps twin ids to shards; ``kept_back`` are the accepted twins of the index that are not published.
    """
    for rows in merge_rows(files_of(root, parts.parts), file_system(root), parts.rows("grasps"), without=kept_back):
        twins = rows["twins"]
        if not len(twins):  # an id range with rejected twins only
            continue
        shards = pa.array([shard_of[twin_id] for twin_id in twins["twin_id"].to_pylist()], pa.string())
        yield {table: rows[table] for table in PUBLISHED} | {"twins": twins.append_column("shard", shards)}


def columns_of(table: str) -> list[str]:
    """Return the column names of a published table."""
    if table == "shards":
        return list(SHARDS.names)
    return [*TABLES[table].names, *(["shard"] if table == "twins" else [])]
