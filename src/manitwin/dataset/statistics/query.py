"""A table of the report: the SQL that gives it, and how its columns are read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

Kind = Literal["text", "count", "number", "given", "share", "signed", "usd"]
Row = dict[str, Any]


@dataclass(frozen=True)
class Column:
    """A column of the report: ``interval`` names the two columns that hold its 95 % interval.

    A ``number`` is written with three digits that count; one that was ``given`` as it is.
    """

    name: str
    heading: str
    kind: Kind = "count"
    interval: tuple[str, str] | None = None


@dataclass(frozen=True)
class Query:
    """SQL (DuckDB, after ``tables.PRELUDE``) with the words that go with its result.

    ``columns`` are those shown; without any, the result is drawn and not shown as a table. ``shown`` is the most rows that
    the report shows: statistics.json has all.
    """

    name: str
    caption: str
    sql: str
    columns: tuple[Column, ...] = ()
    note: str = ""
    shown: int = 40


@dataclass(frozen=True)
class Result:
    """A query and the rows it gave."""

    query: Query
    rows: list[Row]

    @property
    def only(self) -> Row:
        """The one row of a result that has one row."""
        (row,) = self.rows
        return row


def text(value: str) -> str:
    """Return a string as an SQL literal."""
    return "'" + value.replace("'", "''") + "'"


def summary(table: str, quantities: Sequence[tuple[str, str]]) -> str:
    """Return SQL with a row a quantity ``(name, expression)``: its distribution over the rows of a table that have it."""
    names = ", ".join(text(name) for name, _ in quantities)
    values = ", ".join(f"({expression})::DOUBLE" for _, expression in quantities)
    return f"""SELECT quantity, count(value) AS objects, favg(value) AS mean, median(value) AS median,
  quantile_cont(value, 0.1) AS p10, quantile_cont(value, 0.9) AS p90,
  min(value) AS min, max(value) AS max, fsum(value) AS total
FROM (SELECT unnest([{names}]) AS quantity,
             unnest([{values}]) AS value
      FROM {table})
GROUP BY quantity
ORDER BY list_position([{names}], quantity)"""


def summary_columns(heading: str, *, total: bool = True) -> tuple[Column, ...]:
    """Return the columns of ``summary``; ``total`` only where adding up means something."""
    numbers = ("mean", "median", "p10", "p90", "min", "max")
    shown = tuple(Column(name, name, "number") for name in numbers)
    last = (Column("total", "total", "number"),) if total else ()
    return (Column("quantity", heading, "text"), Column("objects", "objects"), *shown, *last)
