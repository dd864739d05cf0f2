"""Queries on an index: DuckDB over the Parquet files of its parts, read-only and locked, with conditions checked beforehand."""

from __future__ import annotations

import math
import re
import threading
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import duckdb
import pyarrow as pa

from manitwin.dataset.index.conditions import check_condition, sql_texts
from manitwin.dataset.index.part_list import (
    PartList,
    no_index,
    read_part_list,
    repair_command,
    require_files,
    require_regular,
)
from manitwin.dataset.index.tables import ORDER, TABLES
from manitwin.errors import UsageError, unknown_name_message
from manitwin.twin.dataset_root import DatasetRoot

_Answer = TypeVar("_Answer")
_FILE_IS_GONE = (duckdb.IOException, duckdb.PermissionException, FileNotFoundError)
"""Errors for a listed file that no longer exists: DuckDB then looks for a folder of that name, which it may not read."""

_OF_THE_CONDITION = (
    duckdb.BinderException,
    duckdb.ParserException,
    duckdb.CatalogException,
    duckdb.ConversionException,
)
"""Errors that a damaged file never causes. After any other DuckDB error, the files are checked for damage."""

TIMEOUT_S = 60.0
MEMORY_GB = 4.0
"""Memory limit of DuckDB (1 GB = 2^30 bytes), which never spills to disk here. Sorting all grasps of 100,000 twins needs more."""


class Index:
    """The six tables of a data set's index as of the first query; reads files on demand and keeps no rows in memory.

    A condition is one SQL expression over a table's columns (DuckDB dialect); subqueries may read the other tables. It cannot
    write, nor read anything else. Raises UsageError if there is no index, if conditions or columns are invalid, and if a query
    exceeds the limits of time (``timeout_s``) or memory (``memory_gb``).
    """

    def __init__(self, root: DatasetRoot | str | Path, *, timeout_s: float = TIMEOUT_S, memory_gb: float = MEMORY_GB):
        for name, value in (("timeout", timeout_s), ("memory", memory_gb)):
            if not 0 < value < math.inf:
                raise UsageError(f"{name} is {value:g}; give a number above 0")
        self.root = root if isinstance(root, DatasetRoot) else DatasetRoot(root)
        self.timeout_s, self.memory_gb = timeout_s, memory_gb
        self._open: tuple[PartList, duckdb.DuckDBPyConnection] | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(type(self), timeout_s=self.timeout_s, memory_gb=self.memory_gb), (
            self.root,
        )  # the receiving process opens its own connection

    @property
    def parts(self) -> PartList:
        """The parts that are read."""
        return self._open_connection()[0]

    @property
    def connection(self) -> duckdb.DuckDBPyConnection:
        """A DuckDB connection with one view per table for custom SQL; it can read the index and nothing else."""
        return self._open_connection()[1]

    def select(
        self,
        table: str = "twins",
        where: Sequence[str] | str = (),
        *,
        columns: Sequence[str] | None = None,
        limit: int | None = None,
    ) -> pa.Table:
        """Return the rows that satisfy all conditions, sorted by twin, with the column types of ``tables.TABLES``."""
        schema = _schema(table)
        names = list(schema.names if columns is None else dict.fromkeys(columns))
        if not names:
            raise UsageError(f"no columns given; choose from {', '.join(schema.names)}")
        for name in names:
            if name not in schema.names:
                raise UsageError(unknown_name_message(f"column of {table}", name, schema.names))
        if limit is not None and limit < 0:
            raise UsageError(f"limit is {limit}; give 0 or more")
        chosen, order = ", ".join(f'"{name}"' for name in names), ", ".join(ORDER[table])
        ending = f"ORDER BY {order}" + ("" if limit is None else f" LIMIT {limit}")
        sql = f"SELECT {chosen} FROM {table} {self.where(where)} {ending}"
        rows = self._run_query(table, lambda connection: connection.sql(sql).to_arrow_table())
        try:
            return rows.cast(pa.schema([schema.field(name) for name in names]))
        except pa.ArrowException as error:
            raise self._damaged(error) from error

    def count(self, table: str = "twins", where: Sequence[str] | str = ()) -> int:
        """Return the number of rows that satisfy all conditions."""
        _schema(table)
        sql = f"SELECT count(*) FROM {table} {self.where(where)}"
        return int(self._run_query(table, lambda connection: connection.sql(sql).fetchall())[0][0])

    def where(self, where: Sequence[str] | str) -> str:
        """Return the WHERE clause of all conditions after checking each; raises UsageError."""
        conditions = [where] if isinstance(where, str) else list(where)
        for condition in conditions:
            check_condition(self.connection, condition)
        # On its own line: a comment at the end of a condition must not swallow the bracket.
        return "WHERE " + " AND ".join(f"(\n{condition}\n)" for condition in conditions) if conditions else ""

    def _run_query(self, table: str, question: Callable[[duckdb.DuckDBPyConnection], _Answer]) -> _Answer:
        try:
            return self._run_limited(table, question)
        except _FILE_IS_GONE:
            self._open = None  # a merge has replaced the files; the new list names the new ones
        try:
            return self._run_limited(table, question)
        except _FILE_IS_GONE as error:
            raise self._damaged(error) from error

    def _run_limited(self, table: str, question: Callable[[duckdb.DuckDBPyConnection], _Answer]) -> _Answer:
        """Run a query within the limits of time and memory; a signal interrupts it as well."""
        connection = self.connection
        timer = threading.Timer(self.timeout_s, connection.interrupt)
        timer.daemon = True
        timer.start()
        try:
            return question(connection)
        except duckdb.InterruptException as error:
            raise UsageError(
                f"condition on {table}: no answer within {self.timeout_s:g} s; simplify it, or allow more time"
                f" (--timeout,"
                " timeout_s)"
            ) from error
        except (duckdb.OutOfMemoryException, MemoryError) as error:
            raise UsageError(
                f"condition on {table}: needs more than {self.memory_gb:g} GB of memory; request fewer rows or"
                f" columns (--limit, --columns), or allow more memory (--memory-gb, memory_gb)"
            ) from error
        except _FILE_IS_GONE:
            raise
        except duckdb.Error as error:
            self._open = None
            if not isinstance(error, _OF_THE_CONDITION):
                require_files(self.root, read_part_list(self.root) or PartList())
            raise UsageError(_explain_error(error, table)) from error
        except UnicodeDecodeError as error:  # undecodable names from a damaged file in DuckDB's message
            raise self._damaged(error) from error
        except RuntimeError as error:
            if "interrupt" in str(error).lower():  # DuckDB's message when a signal handler raised
                raise KeyboardInterrupt from error
            raise
        finally:
            timer.cancel()
            timer.join()  # a thread that outlives the program would hold the connection, and DuckDB's binding reports a leak

    def _open_connection(self) -> tuple[PartList, duckdb.DuckDBPyConnection]:
        if self._open is None:
            parts = read_part_list(self.root)
            if parts is None:
                raise no_index(self.root)
            require_regular(self.root, parts)
            try:
                self._open = (parts, _connect(self.root, parts, self.memory_gb))
            except duckdb.Error as error:
                if not isinstance(error, _FILE_IS_GONE):
                    require_files(self.root, parts)
                raise self._damaged(error) from error
        return self._open

    def _damaged(self, error: Exception) -> UsageError:
        return UsageError(
            f"the index of {self.root.url} cannot be read ({_first_line(error)}); {repair_command(self.root)}"
        )


def _connect(root: DatasetRoot, parts: PartList, memory_gb: float) -> duckdb.DuckDBPyConnection:
    """Return a DuckDB connection with one view per table that can read only the files of these parts and write nothing."""
    connection = duckdb.connect(
        config={
            "autoinstall_known_extensions": False,
            "autoload_known_extensions": False,
            "python_enable_replacements": False,
            "memory_limit": f"{max(1, round(memory_gb * 1024))}MiB",
            "temp_directory": "",
        }
    )
    if root.local is None:
        connection.register_filesystem(root.fs)
    allowed: list[str] = []
    for table, schema in TABLES.items():
        files = [location(root, part.file(table)) for part in parts.parts if part.rows[table]]
        allowed += files
        if files:
            connection.execute(f"CREATE VIEW {table} AS SELECT * FROM read_parquet([{sql_texts(files)}])")
        else:
            connection.from_arrow(schema.empty_table()).create(table)
    connection.execute(f"SET allowed_paths = [{sql_texts(allowed)}]")
    connection.execute("SET enable_external_access = false; SET lock_configuration = true")
    return connection


def location(root: DatasetRoot, name: str) -> str:
    """Return the path of a file as DuckDB names it."""
    full = root.full(name)
    return full if root.local is not None else str(root.fs.unstrip_protocol(full))


def grasps_of(twins: pa.Table) -> list[str]:
    """Return the conditions on ``grasps`` that select given twins (columns ``twin_id, category``).

    The category is included because grasps of a category are contiguous in the files, so that few row groups are read.
    """
    return [f"{name} IN ({sql_texts(sorted(set(twins[name].to_pylist())))})" for name in ("twin_id", "category")]


def _schema(table: str) -> pa.Schema:
    if table not in TABLES:
        raise UsageError(unknown_name_message("table", table, TABLES))
    return TABLES[table]


def _explain_error(error: duckdb.Error, table: str) -> str:
    """Describe an invalid condition in one line; for an unknown column, name the nearest and all valid ones."""
    unknown = re.search(r'Referenced column "(.+?)" not found', str(error))
    if unknown:
        name = unknown.group(1)
        return f"{unknown_name_message(f'column of {table}', name, TABLES[table].names)} (a text is written {sql_texts([name])})"
    return f"condition on {table}: {_first_line(error)}"


def _first_line(error: Exception) -> str:
    return " ".join(str(error).split("\n")[0].split())
