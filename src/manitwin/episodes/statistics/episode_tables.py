"""The views that the report asks: the attempts, and the ranges of joints."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pyarrow as pa

from manitwin.dataset.statistics.query import Query, Result, text
from manitwin.episodes.statistics.queries import PRELUDE


class EpisodeTables:
    """Answer the report's queries from a table of attempts and one of joints."""

    def __init__(self, attempts: pa.Table | Path, joints: pa.Table):
        """Take the attempts as a table or a Parquet file. One thread, so that sums of floats do not depend on the machine."""
        self.connection = duckdb.connect()
        self.connection.execute("SET threads = 1; SET preserve_insertion_order = false")
        if isinstance(attempts, Path):
            self.connection.execute(f"CREATE TEMP VIEW attempts AS SELECT * FROM read_parquet({text(str(attempts))})")
        else:
            self.connection.register("attempts", attempts)
        self.connection.register("joints", joints)
        self.connection.execute(PRELUDE)

    def result(self, query: Query) -> Result:
        """Run a query; floats come with 12 digits."""
        cursor = self.connection.execute(query.sql)
        names = [column[0] for column in cursor.description]
        return Result(query, [dict(zip(names, map(_rounded, row), strict=True)) for row in cursor.fetchall()])


def _rounded(value: object) -> object:
    return float(f"{value:.12g}") if isinstance(value, float) else value
