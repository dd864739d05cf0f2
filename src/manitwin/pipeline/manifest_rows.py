"""The rows of a manifest file: CSV with a header, or JSONL."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from manitwin.errors import UsageError
from manitwin.formats.csv_file import read_csv, read_lines
from manitwin.formats.json_file import parse_json


def manifest_rows(path: Path, columns: tuple[str, ...]) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield each row of a manifest with its line number; values of ``columns`` are strings, numbers or None.

    Raises UsageError with file and line.
    """
    yield from read_csv(path, UsageError) if path.suffix.lower() == ".csv" else _jsonl_rows(path, columns)


def _jsonl_rows(path: Path, columns: tuple[str, ...]) -> Iterator[tuple[int, dict[str, Any]]]:
    for number, line in enumerate(read_lines(path, UsageError), 1):
        if not line.strip():
            continue
        row = parse_json(line, f"{path}:{number}", UsageError, file_names=True)
        if not isinstance(row, dict):
            raise UsageError(
                f"{path}:{number}: each line must be a JSON object with 'file' or 'text', not {type(row).__name__}"
            )
        for column in columns:
            value = row.get(column)
            if isinstance(value, bool | list | dict):
                raise UsageError(f"{path}:{number}: {column}: is a {type(value).__name__}; give one text or number")
        yield number, row
