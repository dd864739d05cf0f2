"""Tables of an evaluation, printed to the terminal, as one JSON document, and as a folder of CSV, Parquet and HTML."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.dataset.report_page import Picture, Section, Table, page
from manitwin.dataset.statistics.query import Result
from manitwin.formats.output_folder import new_folder
from manitwin.formats.printable import printable_line
from manitwin.twin.store import canonical_json

MEASURED, NOT_MEASURED, MISSING = "here", "not measured", "–"
"""Column of measured figures, its text for missing values, and the text in other columns."""
WHY = "why"
"""Column of reasons, which the terminal shows below the table."""
DOCUMENT, REPORT = "evaluation.json", "report.html"
_MOST_PRINTED = 25
_WIDEST = 60

Row = dict[str, Any]


@dataclass(frozen=True)
class EvaluationTable:
    """Rows with equal columns; None marks values that were not measured or are undefined.

    ``printed`` tables are shown in the terminal; tables with one row per twin are for files only.
    """

    name: str
    caption: str
    rows: Sequence[Row]
    note: str = ""
    printed: bool = True

    @classmethod
    def of(cls, result: Result) -> EvaluationTable:
        """Return the table of a query's rows with all columns."""
        return cls(result.query.name, result.query.caption, result.rows, result.query.note)


@dataclass(frozen=True)
class EvaluationReport:
    """An evaluation: lead sentences, tables in order, the models used, and sample pictures."""

    title: str
    lead: Sequence[str]
    tables: Sequence[EvaluationTable]
    models: Mapping[str, Mapping[str, Any] | None]
    pictures: Sequence[Picture] = ()

    def table(self, name: str) -> Sequence[Row]:
        """Return the rows of a table."""
        return next(table.rows for table in self.tables if table.name == name)

    def document(self) -> dict[str, Any]:
        """Return all numbers as JSON values."""
        return {
            "title": self.title,
            "lead": list(self.lead),
            "models": {name: None if model is None else dict(model) for name, model in self.models.items()},
            "tables": {table.name: [dict(row) for row in table.rows] for table in self.tables},
        }

    def lines(self) -> list[str]:
        """Return the tables as text."""
        lines = list(self.lead)
        for table in self.tables:
            if table.printed and table.rows:
                shown = [{name: row[name] for name in row if name != WHY} for row in table.rows[:_MOST_PRINTED]]
                lines += ["", table.caption, *_align_columns(shown)]
                lines += [f"  {row['metric']} ({row['comparable']}): {row[WHY]}" for row in table.rows if WHY in row]
                if len(table.rows) > _MOST_PRINTED:
                    lines.append(f"... and {len(table.rows) - _MOST_PRINTED} more: use --out or --json for all")
        return lines


def write_evaluation(out: Path, report: EvaluationReport) -> None:
    """Write ``evaluation.json``, ``report.html`` and each table as ``.csv`` and ``.parquet`` into a new folder.

    The folder is written atomically; equal input gives equal bytes. Raises UsageError for a folder that is not empty.
    """
    parts: list[Picture | Table] = [
        Table(
            " ".join(each for each in (table.caption, table.note) if each),
            [_heading(name) for name in table.rows[0]],
            [[_display_value(name, value) for name, value in row.items()] for row in table.rows],
        )
        for table in report.tables
        if table.rows
    ]
    sections = [Section("Tables", parts), *([Section("Samples", report.pictures)] if report.pictures else [])]
    with new_folder(out) as folder:
        (folder / DOCUMENT).write_text(canonical_json(report.document()), encoding="utf-8")
        (folder / REPORT).write_bytes(page(report.title, report.lead, sections))
        for table in report.tables:
            if table.rows:
                (folder / f"{table.name}.csv").write_text(_csv(table.rows), encoding="utf-8")
                pq.write_table(
                    pa.Table.from_pylist([dict(row) for row in table.rows]), folder / f"{table.name}.parquet"
                )


def _csv(rows: Sequence[Row]) -> str:
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def _align_columns(rows: Sequence[Row]) -> list[str]:
    texts = [[_heading(name) for name in rows[0]], *([_text(name, row[name]) for name in row] for row in rows)]
    widths = [max(len(row[place]) for row in texts) for place in range(len(texts[0]))]
    return ["  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in texts]


def _heading(name: str) -> str:
    return name.replace("_", " ")


def _display_value(name: str, value: Any) -> str | int | float | None:
    if value is None and name == MEASURED:
        return NOT_MEASURED
    return value if value is None or isinstance(value, str | int | float) else str(value)


def _text(name: str, value: Any) -> str:
    if value is None:
        return NOT_MEASURED if name == MEASURED else MISSING
    if isinstance(value, float):
        return f"{value:.4g}"
    return printable_line(str(value), max_characters=_WIDEST)
