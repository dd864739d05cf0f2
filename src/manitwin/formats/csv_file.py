"""Parser of untrusted CSV with bounded rows and values; all CSV from outside the package is read here."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from manitwin.formats.bounded_file import Refusal, open_regular
from manitwin.formats.printable import printable_line

MAX_LINE_BYTES = 1 << 20
MAX_COLUMNS = 512
"""Every row is padded to the length of the header, so that 20,000 short rows with 100,000 columns would take minutes."""

_OTHER_MARKS = {";": "semicolons", "\t": "tabs"}


def read_csv(path: Path, refuse: Refusal, *, name: str | None = None) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield the rows of a CSV file (RFC 4180) with a header, as the line number where each ends and its values.

    Rows are read lazily. Raises the error that ``refuse`` makes of a line naming file and line number: not UTF-8, an unclosed
    quote, semicolons or tabs between columns, a value of more than csv's 128 KiB, a line of more than ``MAX_LINE_BYTES``, more
    than ``MAX_COLUMNS`` columns, or more values than columns.
    """
    called = name or str(path)
    reader = csv.DictReader(read_lines(path, refuse, name=called), strict=True)
    try:
        header = reader.fieldnames or ()
        columns = len(header)
        for mark, told in _OTHER_MARKS.items() if columns == 1 else ():
            if mark in header[0]:
                raise refuse(f"{called}:1: its columns are separated by {told}; save it with commas as separators")
        if columns > MAX_COLUMNS:
            raise refuse(
                f"{called}:{reader.line_num}: {columns:,} columns; at most {MAX_COLUMNS} are read; remove columns"
                f" that are not needed"
            )
        for row in reader:
            if None in row:
                raise refuse(f"{called}:{reader.line_num}: more values than columns; quote values that contain a comma")
            yield reader.line_num, row
    except csv.Error as error:
        cause = printable_line(str(error), max_characters=120)
        remedy = "close the quotes, and double a quote within a value"
        raise refuse(f"{called}:{reader.line_num}: not CSV ({cause}); {remedy}") from error


def read_lines(path: Path, refuse: Refusal, *, name: str | None = None) -> Iterator[str]:
    """Yield the lines of a regular UTF-8 text file with their ends; a line of more than ``MAX_LINE_BYTES`` is refused."""
    called = name or str(path)
    with open_regular(path, refuse, name=called) as stream:
        number = 0
        while line := stream.readline(MAX_LINE_BYTES + 1):
            number += 1
            if len(line) > MAX_LINE_BYTES:
                raise refuse(f"{called}:{number}: a line of more than {MAX_LINE_BYTES} bytes; split it into rows")
            try:
                yield line.decode("utf-8-sig" if number == 1 else "utf-8")
            except UnicodeDecodeError as error:
                cause = f"{error.reason} at byte {stream.tell() - len(line) + error.start}"
                raise refuse(f"{called}: not UTF-8 text ({cause}); save it as UTF-8") from error
