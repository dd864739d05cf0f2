"""SQL conditions: quote literals, and check user conditions before DuckDB runs them."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

import duckdb

from manitwin.dataset.index.tables import TABLES
from manitwin.errors import UsageError, unknown_name_message

_CONDITION_CHARACTERS = 100_000
"""Maximum length of a condition. Conditions written by this package list up to a thousand twin ids of 20 characters each."""

EXAMPLE = "\"category = 'mug' and mass_kg < 0.4\""
_ALONE: dict[str, Any] = {
    **dict.fromkeys(("where_clause", "having", "qualify", "sample")),
    **{name: [] for name in ("modifiers", "group_expressions", "group_sets")},
    "aggregate_handling": "STANDARD_HANDLING",
}
"""Fields in DuckDB's parse tree of a SELECT that has nothing but its list of expressions."""

_REFUSED = {
    "TABLE_FUNCTION": "functions that make tables",
    "SHOW_REF": "DESCRIBE and SHOW",
    "PIVOT": "PIVOT",
    "PARAMETER": "parameters",
}


def sql_texts(values: Iterable[str]) -> str:
    """Return texts as comma-separated SQL literals."""
    return ", ".join(map(sql_text, values))


def sql_text(value: str) -> str:
    """Return a text as a quoted SQL literal."""
    return "'" + value.replace("'", "''") + "'"


def check_condition(connection: duckdb.DuckDBPyConnection, condition: str) -> None:
    """Raise UsageError unless a condition is exactly one SQL expression that reads nothing but the index tables.

    DuckDB's own parser produces the syntax tree that is checked (``json_serialize_sql``). Subqueries may read the six tables.
    This check is one of two safeguards: the connection is locked as well.
    """
    if len(condition) > _CONDITION_CHARACTERS:
        said = f"{len(condition)} characters, {_CONDITION_CHARACTERS} at most"
        raise UsageError(f"condition {_short(condition[:200])}: {said}; give a shorter condition")
    statement = f"SELECT\n{condition}\n"
    try:
        [(parsed,)] = connection.execute("SELECT json_serialize_sql(?)", [statement]).fetchall()
        _check_tree(json.loads(parsed), condition)
    except RecursionError as error:
        raise UsageError(f"condition {_short(condition)}: nested too deeply; simplify it") from error


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
        raise UsageError(f"condition {_short(condition)}: not a single condition; give one such as {EXAMPLE}")
    _check_nodes(node["select_list"], condition)


def _check_nodes(node: Any, condition: str) -> None:
    if isinstance(node, list):
        for each in node:
            _check_nodes(each, condition)
    elif isinstance(node, dict):
        refused = _REFUSED.get(str(node.get("type")), _REFUSED.get(str(node.get("class"))))
        if refused:
            raise UsageError(
                f"condition {_short(condition)}: {refused} is not allowed; a condition may read the tables"
                f" {', '.join(TABLES)}"
            )
        if node.get("type") == "BASE_TABLE":
            path = [node[part] for part in ("catalog_name", "schema_name", "table_name") if node[part]]
            if len(path) != 1 or path[0].lower() not in TABLES:
                raise UsageError(
                    f"condition {_short(condition)}: {unknown_name_message('table', '.'.join(path), TABLES)}"
                )
        for value in node.values():
            _check_nodes(value, condition)


def _short(condition: str) -> str:
    line = " ".join(condition.split())
    return f"{line!r}" if len(line) <= 80 else f"{line[:77]!r}..."
