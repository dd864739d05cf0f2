"""``manitwin query``: find twins, grasps and the rest by a condition."""

from __future__ import annotations

import csv
import io
import json
import os
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manitwin.cli import option_values
from manitwin.cli.console import out_console, print_layout_notice, write_json, write_text
from manitwin.formats.plurals import counted
from manitwin.formats.printable import printable_line

if TYPE_CHECKING:
    import pyarrow as pa

SHOWN = {
    "twins": ("twin_id", "name", "category", "mass_kg", "longest_m", "verified", "success_rate"),
    "points": ("twin_id", "point_id", "role", "label", "type", "confidence"),
    "grasps": ("twin_id", "grasp_id", "category", "outcome", "verified", "robustness", "holds_in_second_engine"),
    "placements": ("twin_id", "number", "upright", "probability", "settled", "collision_radius_m"),
    "rejections": ("twin_id", "name", "stage", "reason", "detail"),
    "stages": ("twin_id", "position", "stage", "backend", "seconds", "cpu_seconds", "cost_usd"),
}
"""What a table on the screen shows where no columns are asked for; the other formats write all."""

Write = Callable[[str], None]

NARROWEST = 16
"""Characters that a column keeps: a twin's id."""


def query(
    dataset: Annotated[str, typer.Argument(help="A data set: a folder or URL.", metavar="DATASET")],
    where: Annotated[
        str | None, typer.Argument(help="An SQL condition: \"category = 'mug' and mass_kg < 0.4\". Default: all rows.")
    ] = None,
    table: Annotated[
        str,
        option_values.TABLES.option(
            help="Table: twins, points, grasps, placements, rejections or stages.", metavar="NAME"
        ),
    ] = "twins",
    columns: Annotated[str | None, typer.Option(help="Columns to print, separated by commas.", metavar="A,B")] = None,
    limit: Annotated[
        int | None,
        typer.Option(help="Maximum number of rows to print.", metavar="N", min=0, max=option_values.LARGEST_COUNT),
    ] = None,
    format: Annotated[
        str,
        option_values.QUERY_FORMATS.option(
            "--format", "-f", help="Output format: table, csv, json or ids.", metavar="FORMAT"
        ),
    ] = "table",
    timeout: Annotated[
        float,
        typer.Option(
            help="Time limit of the query, in seconds.",
            metavar="SECONDS",
            callback=option_values.amount_callback("--timeout", 1e6),
        ),
    ] = 60.0,
    memory_gb: Annotated[
        float,
        typer.Option(
            help="Memory limit of the query.", metavar="GB", callback=option_values.amount_callback("--memory-gb", 1e5)
        ),
    ] = 4.0,
) -> None:
    """Print the rows of a data set's index that satisfy a condition, sorted by twin."""
    from manitwin.errors import UsageError

    if format == "ids" and columns is not None:
        raise UsageError("--format ids prints only the ids of twins; leave out --columns, or choose another format")
    from manitwin.dataset.index.query import Index

    names = [name.strip() for name in columns.split(",")] if columns is not None else None
    if names is None and format == "table":
        names = list(SHOWN.get(table, ())) or None
    if format == "ids":
        names = ["twin_id"]
    answers = Index(dataset, timeout_s=timeout, memory_gb=memory_gb)
    print_layout_notice(answers.root)
    rows = answers.select(table, where or (), columns=names, limit=limit)
    try:
        WRITERS[format](rows, write_json if format == "json" else write_text)
        sys.stdout.flush()
    except BrokenPipeError:  # `| head` has seen enough; Python flushes once more at its end (its manual, "SIGPIPE")
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _write_table(rows: pa.Table, write: Write) -> None:
    """Write columns side by side; a terminal's width cuts the widest ones, into a file or pipe they go whole."""
    lines = [rows.column_names, *([_shown(value) for value in row.values()] for row in rows.to_pylist())]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    room = out_console.width - 2 * (len(widths) - 1) if out_console.is_terminal else sum(widths)
    while sum(widths) > room and max(widths) > NARROWEST:
        widths[widths.index(max(widths))] -= 1
    for line in lines:
        cells = (_cut(cell, width).ljust(width) for cell, width in zip(line, widths, strict=True))
        write("  ".join(cells).rstrip() + "\n")
    write(f"{counted(len(rows), 'rows')}\n")


def _cut(cell: str, width: int) -> str:
    return cell if len(cell) <= width else cell[: width - 1] + "…"


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return json.dumps([float(f"{v:.4g}") if isinstance(v, float) else v for v in value])
    return "" if value is None else printable_line(" ".join(str(value).split()))


def _write_csv(rows: pa.Table, write: Write) -> None:
    """Write RFC 4180 with what a terminal would obey escaped; --format json keeps every character."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(rows.column_names)
    for batch in rows.to_batches(max_chunksize=4096):
        for row in batch.to_pylist():
            writer.writerow([json.dumps(value) if isinstance(value, list) else value for value in row.values()])
        write(stream.getvalue())
        stream.seek(0)
        stream.truncate()
    write(stream.getvalue())


def _write_json(rows: pa.Table, write: Write) -> None:
    """Write one array with one row a line, so that it can also be read line by line."""
    before = "[\n"
    for batch in rows.to_batches(max_chunksize=4096):
        for row in batch.to_pylist():
            write(before + json.dumps(row, ensure_ascii=False))
            before = ",\n"
    write("\n]\n" if len(rows) else "[]\n")


def _write_ids(rows: pa.Table, write: Write) -> None:
    for twin_id in dict.fromkeys(rows["twin_id"].to_pylist()):
        write(f"{printable_line(twin_id)}\n")


WRITERS: dict[str, Callable[[pa.Table, Write], None]] = {
    "table": _write_table,
    "csv": _write_csv,
    "json": _write_json,
    "ids": _write_ids,
}
