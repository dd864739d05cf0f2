"""Ask an index: DuckDB over the Parquet files of its parts, read-only and locked, with conditions that are checked first."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import duckdb
import pyarrow as pa

from manitwin.dataset.index.part_list import PartList, read_part_list
from manitwin.dataset.index.tables import ORDER, TABLES
from manitwin.errors import UsageError, choose_from
from manitwin.twin.dataset_root import DatasetRoot

_Answer = TypeVar("_Answer")
_FILE_IS_GONE = (duckdb.IOException, duckdb.PermissionException, FileNotFoundError)
"""What a file of the list raises that is not there any more: DuckDB then looks for a folder of that name, and may not."""

EXAMPLE = "\"category = 'mug' and mass_kg < 0.4\""
_ALONE: dict[str, Any] = {
    **dict.fromkeys(("where_clause", "having", "qualify", "sample")),
    **{name: [] for name in ("modifiers", "group_expressions", "group_sets")},
    "aggregate_handling": "STANDARD_HANDLING",
}
"""What DuckDB's parser says of a SELECT that has no more than its list of expressions."""

_REFUSED = {
    "TABLE_FUNCTION": "functions that make tables",
    "SHOW_REF": "DESCRIBE and SHOW",
    "PIVOT": "PIVOT",
    "PARAMETER": "parameters",
}


class Index:
    """The six tables of a data set's index, as they are when first asked; reads the files, holds nothing.

    A condition is one SQL expression over a table's columns (DuckDB's dialect); subqueries may read the other tables. It
    cannot write, and can read nothing else. Raises UsageError where there is no index, and for conditions and columns that
    cannot be used.
    """

    def __init__(self, root: DatasetRoot | str | Path):
        self.root = root if isinstance(root, DatasetRoot) else DatasetRoot(root)
        self._open: tuple[PartList, duckdb.DuckDBPyConnection] | None = None

    def __reduce__(self) -> tuple[type, tuple[DatasetRoot]]:
        return type(self), (self.root,)  # another process opens the files anew

    @property
    def parts(self) -> PartList:
        """The parts that are read."""
        return self._opened()[0]

    @property
    def connection(self) -> duckdb.DuckDBPyConnection:
        """DuckDB with a view for each table, for SQL of one's own; it can read the index and nothing else."""
        return self._opened()[1]

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
                raise UsageError(choose_from(f"column of {table}", name, schema.names))
        if limit is not None and limit < 0:
            raise UsageError(f"limit is {limit}; give 0 or more")
        chosen, order = ", ".join(f'"{name}"' for name in names), ", ".join(ORDER[table])
        ending = f"ORDER BY {order}" + ("" if limit is None else f" LIMIT {limit}")
        sql = f"SELECT {chosen} FROM {table} {self.where(where)} {ending}"
        rows = self._ask(table, lambda connection: connection.sql(sql).to_arrow_table())
        return rows.cast(pa.schema([schema.field(name) for name in names]))

    def count(self, table: str = "twins", where: Sequence[str] | str = ()) -> int:
        """Return how many rows satisfy all conditions."""
        _schema(table)
        sql = f"SELECT count(*) FROM {table} {self.where(where)}"
        return int(self._ask(table, lambda connection: connection.sql(sql).fetchall())[0][0])

    def where(self, where: Sequence[str] | str) -> str:
        """Return the WHERE clause of all conditions, each of them checked; raises UsageError."""
        conditions = [where] if isinstance(where, str) else list(where)
        for condition in conditions:
            check_condition(self.connection, condition)
        # a line of its own: a comment at a condition's end must not swallow the bracket
        return "WHERE " + " AND ".join(f"(\n{condition}\n)" for condition in conditions) if conditions else ""

    def _ask(self, table: str, question: Callable[[duckdb.DuckDBPyConnection], _Answer]) -> _Answer:
        try:
            return question(self.connection)
        except _FILE_IS_GONE:
            self._open = None  # a merge has replaced the files since: the new list names the new ones
        except duckdb.Error as error:
            raise UsageError(_explained(error, table)) from error
        try:
            return question(self.connection)
        except _FILE_IS_GONE as error:
            raise UsageError(
                f"the index of {self.root.url} lacks a file ({_first_line(error)}); run manitwin index"
            ) from error

    def _opened(self) -> tuple[PartList, duckdb.DuckDBPyConnection]:
        if self._open is None:
            parts = read_part_list(self.root)
            if parts is None:
                raise UsageError(f"{self.root.url}: has no index; run manitwin index {self.root.url}")
            self._open = (parts, _connect(self.root, parts))
        return self._open


def _connect(root: DatasetRoot, parts: PartList) -> duckdb.DuckDBPyConnection:
    """Return a DuckDB that has a view for each table, reads the files of these parts alone and writes none."""
    connection = duckdb.connect(
        config={
            "autoinstall_known_extensions": False,
            "autoload_known_extensions": False,
            "python_enable_replacements": False,
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
    """Return a file's place as DuckDB names it."""
    full = root.full(name)
    return full if root.local is not None else str(root.fs.unstrip_protocol(full))


def sql_texts(values: Iterable[str]) -> str:
    """Return texts as SQL writes them, with commas between."""
    return ", ".join(map(sql_text, values))


def sql_text(value: str) -> str:
    """Return a text as an SQL literal."""
    return "'" + value.replace("'", "''") + "'"


def grasps_of(twins: pa.Table) -> list[str]:
    """Return the conditions on ``grasps`` for given twins (columns ``twin_id, category``).

    With their categories, as these grasps lie together in the files: few row groups are read.
    """
    return [f"{name} IN ({sql_texts(sorted(set(twins[name].to_pylist())))})" for name in ("twin_id", "category")]


def _schema(table: str) -> pa.Schema:
    if table not in TABLES:
        raise UsageError(choose_from("table", table, TABLES))
    return TABLES[table]


def _explained(error: duckdb.Error, table: str) -> str:
    """Describe what is wrong with a condition in one line; for an unknown column, name the nearest and all there are."""
    unknown = re.search(r'Referenced column "(.+?)" not found', str(error))
    if unknown:
        name = unknown.group(1)
        return f"{choose_from(f'column of {table}', name, TABLES[table].names)} (a text is written {sql_texts([name])})"
    return f"condition on {table}: {_first_line(error)}"


def _first_line(error: Exception) -> str:
    return " ".join(str(error).split("\n")[0].split())


def check_condition(connection: duckdb.DuckDBPyConnection, condition: str) -> None:
    """Raise UsageError for what is not exactly one SQL expression, or reads anything but the tables of the index.

    DuckDB's own parser says what it is (``json_serialize_sql``). Subqueries may read the six tables. This is one of two
    bolts: the connection is locked too.
    """
    statement = f"SELECT\n{condition}\n"
    try:
        [(parsed,)] = connection.execute("SELECT json_serialize_sql(?)", [statement]).fetchall()
        _check_tree(json.loads(parsed), condition)
    except RecursionError as error:
        raise UsageError(f"condition {_short(condition)}: nested too deeply; write it flatter") from error


def _check_tree(tree: dict[str, Any], condition: str) -> None:
    if tree.get("error", True):
        message = " ".join(str(tree.get("error_message", "cannot be parsed")).split())
        raise UsageError(f"condition {_short(condition)}: {message}; give one SQL condition such as {EXAMPLE}")
    node = tree["statements"][0]["node"] if len(tree["statements"]) == 1 else {}
    alone = (
        node.get("type") == "SELECT_NODE"
        and len(node["select_list"]) == 1
        and not node["select_list"][0]["alias"]
        and node["from_table"]["type"] == "EMPTY"
        and not node["cte_map"]["map"]
        and all(node.get(key) == value for key, value in _ALONE.items())
    )
    if not alone:
        raise UsageError(f"condition {_short(condition)}: not one condition; give one such as {EXAMPLE}")
    _check_nodes(node["select_list"], condition)


def _check_nodes(node: Any, condition: str) -> None:
    if isinstance(node, list):
        for each in node:
            _check_nodes(each, condition)
    elif isinstance(node, dict):
        refused = _REFUSED.get(str(node.get("type")), _REFUSED.get(str(node.get("class"))))
        if refused:
            raise UsageError(
                f"condition {_short(condition)}: {refused} may not be used; it may read the tables {', '.join(TABLES)}"
            )
        if node.get("type") == "BASE_TABLE":
            path = [node[part] for part in ("catalog_name", "schema_name", "table_name") if node[part]]
            if len(path) != 1 or path[0].lower() not in TABLES:
                raise UsageError(f"condition {_short(condition)}: {choose_from('table', '.'.join(path), TABLES)}")
        for value in node.values():
            _check_nodes(value, condition)


def _short(condition: str) -> str:
    line = " ".join(condition.split())
    return f"{line!r}" if len(line) <= 80 else f"{line[:77]!r}..."
