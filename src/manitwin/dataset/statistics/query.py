"""Report queries: SQL with display columns, and the DuckDB connection that runs them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import duckdb
import pyarrow as pa
from fsspec import AbstractFileSystem

from manitwin.dataset.index.conditions import sql_texts
from manitwin.dataset.index.part_list import repair_command, require_files
from manitwin.dataset.index.query import Index, location
from manitwin.dataset.index.tables import TABLES
from manitwin.errors import UsageError
from manitwin.formats.printable import printable_line
from manitwin.twin.dataset_root import DatasetRoot

Kind = Literal["text", "count", "number", "given", "share", "signed", "usd"]
Row = dict[str, Any]

PRELUDE = """-- Wilson's 95 % interval of a share k of n (E. B. Wilson, J. Am. Stat. Assoc. 22, 1927); z = 1.96, z^2 = 3.84
CREATE OR REPLACE TEMP MACRO wilson_centre(k, n) AS (k + 3.841458820694124 / 2) / (n + 3.841458820694124);
CREATE OR REPLACE TEMP MACRO wilson_half(k, n) AS
  1.959963984540054 * sqrt(k * (n - k) / n + 3.841458820694124 / 4) / (n + 3.841458820694124);
CREATE OR REPLACE TEMP MACRO wilson_low(k, n) AS
  CASE WHEN n > 0 THEN greatest(wilson_centre(k, n) - wilson_half(k, n), 0) END;
CREATE OR REPLACE TEMP MACRO wilson_high(k, n) AS
  CASE WHEN n > 0 THEN least(wilson_centre(k, n) + wilson_half(k, n), 1) END;
-- rows of grasps.parquet by what they are: the twin's own, the unfiltered sample, the jittered controls
CREATE OR REPLACE TEMP MACRO unfiltered(proposer) AS suffix(proposer, ':unfiltered');
CREATE OR REPLACE TEMP MACRO jittered(proposer) AS suffix(proposer, ':jittered');
CREATE OR REPLACE TEMP MACRO own(proposer) AS NOT unfiltered(proposer) AND NOT jittered(proposer);
"""


@dataclass(frozen=True)
class Column:
    """A column of the report; ``interval`` names the two columns with its 95 % interval.

    A ``number`` is written with three significant digits, a ``given`` value as it is.
    """

    name: str
    heading: str
    kind: Kind = "count"
    interval: tuple[str, str] | None = None


def labels(*names: str) -> tuple[Column, ...]:
    """Return text columns headed by their names."""
    return tuple(Column(name, name, "text") for name in names)


def counts(*names: str) -> tuple[Column, ...]:
    """Return count columns headed by their names."""
    return tuple(Column(name, name) for name in names)


@dataclass(frozen=True)
class Query:
    """SQL (DuckDB, run after ``PRELUDE``) with the texts shown with its result.

    ``columns`` are the displayed ones; without any, the result is only drawn. ``shown`` is the maximum number of displayed rows;
    statistics.json has all rows.
    """

    name: str
    caption: str
    sql: str
    columns: tuple[Column, ...] = ()
    note: str = ""
    shown: int = 40


@dataclass(frozen=True)
class Result:
    """A query and its rows."""

    query: Query
    rows: list[Row]

    @property
    def only(self) -> Row:
        """The single row of a result."""
        (row,) = self.rows
        return row


def summary(
    name: str,
    caption: str,
    quantities: Mapping[str, str],
    *,
    table: str = "twins",
    rows: str = "objects",
    heading: str = "quantity",
    total: bool = False,
    note: str = "",
) -> Query:
    """Return the query of the distributions of ``{quantity: expression}`` over a table, one row per quantity.

    ``rows`` heads the number of non-null values; ``total`` adds the sum, for quantities that can be added.
    """
    names = sql_texts(quantities)
    values = ", ".join(f"({expression})::DOUBLE" for expression in quantities.values())
    sql = f"""SELECT quantity, count(value) AS objects, favg(value) AS mean, median(value) AS median,
  quantile_cont(value, 0.1) AS p10, quantile_cont(value, 0.9) AS p90,
  min(value) AS min, max(value) AS max, fsum(value) AS total
FROM (SELECT unnest([{names}]) AS quantity,
             unnest([{values}]) AS value
      FROM {table})
GROUP BY quantity
ORDER BY list_position([{names}], quantity)"""
    spread = ("mean", "median", "p10", "p90", "min", "max", *(["total"] if total else []))
    columns = (Column("objects", rows), *(Column(each, each, "number") for each in spread))
    return Query(name, caption, sql, (Column("quantity", heading, "text"), *columns), note)


def histogram(name: str, caption: str, place: str, where: str, *, rows: str = "objects", table: str = "twins") -> Query:
    """Return the query that counts the ``rows`` of a table per value of ``place``, given as ``expression AS name``."""
    key = place.rpartition(" ")[2]
    sql = f"SELECT {place}, count(*) AS {rows} FROM {table}\nWHERE {where} GROUP BY {key} ORDER BY {key}"
    return Query(name, caption, sql)


class ReportTables:
    """Runs a report's queries on named tables."""

    def __init__(
        self,
        tables: Mapping[str, pa.Table | str],
        *,
        prelude: str = PRELUDE,
        file_system: AbstractFileSystem | None = None,
        remedy: str = "run manitwin check DATASET",
    ):
        """Register each table, given as a pyarrow table or as SQL such as ``read_parquet('...')``; ``prelude`` defines the
        macros.

        ``file_system`` reads non-local files. DuckDB uses a single thread, so that sums of floats do not depend on the order of
        threads, and memory stays flat. ``remedy`` ends the error message for unreadable tables.
        """
        self._remedy = remedy
        self.connection = duckdb.connect()
        self.connection.execute("SET threads = 1; SET preserve_insertion_order = false")
        if file_system is not None:
            self.connection.register_filesystem(file_system)
        for name, table in tables.items():
            if isinstance(table, str):
                try:
                    self.connection.execute(f"CREATE TEMP VIEW {name} AS SELECT * FROM {table}")
                except duckdb.Error as error:
                    raise self._unreadable(error) from error
            else:
                self.connection.register(name, table)
        self.connection.execute(prelude)

    @classmethod
    def of_index(cls, root: DatasetRoot) -> ReportTables:
        """Open a data set's index; raises UsageError if it has none."""
        found = Index(root).parts
        require_files(root, found)
        parts = found.parts
        tables: dict[str, pa.Table | str] = {}
        for name, schema in TABLES.items():
            files = [location(root, part.file(name)) for part in parts if part.rows[name]]
            tables[name] = f"read_parquet([{sql_texts(files)}])" if files else schema.empty_table()
        return cls(tables, file_system=None if root.local is not None else root.fs, remedy=repair_command(root))

    def result(self, query: Query) -> Result:
        """Run a query. Floats are rounded to 12 digits, so that they do not depend on the distribution of rows over files.

        Raises UsageError if a file has been replaced meanwhile, or cannot be read.
        """
        try:
            cursor = self.connection.execute(query.sql)
            names = [column[0] for column in cursor.description]
            rows = cursor.fetchall()
        except (duckdb.IOException, FileNotFoundError) as error:
            line = str(error).split("\n")[0]
            raise UsageError(f"the index changed while it was read ({line}); rerun the same command") from error
        except (duckdb.Error, MemoryError) as error:
            raise self._unreadable(error) from error
        except RuntimeError as error:
            if "interrupt" in str(error).lower():  # DuckDB's message when a signal handler raised
                raise KeyboardInterrupt from error
            raise
        return Result(query, [dict(zip(names, map(_rounded, row), strict=True)) for row in rows])

    def _unreadable(self, error: Exception) -> UsageError:
        line = printable_line(str(error).split("\n")[0], max_characters=160)
        return UsageError(f"the tables cannot be read ({line}); {self._remedy}")


def _rounded(value: Any) -> Any:
    return float(f"{value:.12g}") if isinstance(value, float) else value
