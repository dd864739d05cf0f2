"""Table of verdicts, one row per answer, written as Parquet, CSV or JSONL."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.dataset.review.store import Stored
from manitwin.dataset.review.verdicts import DIMENSIONS
from manitwin.errors import UsageError, unknown_name_message
from manitwin.twin.store import write_bytes_atomically

_TEXT, _REAL = pa.string(), pa.float64()
_NUMBERS = (
    "seconds", "mass_kg", "mass_low_kg", "mass_high_kg", "longest_side_m", "longest_side_low_m", "longest_side_high_m",
)  # fmt: skip
SCHEMA = pa.schema(
    {
        "twin_id": _TEXT, "revision": _TEXT, "annotator": _TEXT, "dimension": _TEXT, "answer": _TEXT, "category": _TEXT,
        **dict.fromkeys(_NUMBERS[1:], _REAL), "points": _TEXT, "note": _TEXT, "blind": pa.bool_(), "seconds": _REAL,
        "prompt": _TEXT, "number": pa.int64(), "at": _REAL,
    }
)  # fmt: skip
"""``points`` is 'f0=12;g1=3', point and candidate. ``at`` is in seconds since the epoch; ``seconds`` is the time of the whole
review.
"""
FORMATS = (".parquet", ".csv", ".jsonl")


def table_of(reviews: Iterable[Stored]) -> pa.Table:
    """Return verdicts as a table sorted by twin, annotator, review number and dimension."""
    rows = [row for stored in reviews for row in _rows(stored)]
    rows.sort(key=lambda row: (row["twin_id"], row["annotator"], row["number"], DIMENSIONS.index(row["dimension"])))
    return pa.Table.from_pylist(rows, schema=SCHEMA)


def _rows(stored: Stored) -> Iterator[dict[str, Any]]:
    review = stored.review
    for dimension in DIMENSIONS:
        if dimension not in review.answers:
            continue
        said: dict[str, Any] = {}
        corrected = review.corrections.of(dimension)
        if dimension == "physical":
            for name, stem, unit in (("mass_kg", "mass", "kg"), ("longest_side_m", "longest_side", "m")):
                measure: Any = corrected.get(name)
                if measure is not None:
                    said |= {name: measure["value"], f"{stem}_low_{unit}": measure["low"]}
                    said[f"{stem}_high_{unit}"] = measure["high"]
        elif dimension == "category":
            said |= corrected
        elif corrected:
            said["points"] = ";".join(f"{point}={place}" for point, place in corrected.items())
        yield {
            "twin_id": review.twin_id, "revision": review.revision, "annotator": review.annotator,
            "dimension": dimension, "answer": review.answers[dimension], **said, "note": review.note or None,
            "blind": review.blind, "seconds": review.seconds, "prompt": review.prompts.get(dimension),
            "number": stored.number, "at": stored.at,
        }  # fmt: skip


def write_verdicts(table: pa.Table, path: Path) -> None:
    """Write a table in the format of the file's suffix; raises UsageError for an unknown suffix."""
    if path.suffix not in FORMATS:
        raise UsageError(f"{path}: {unknown_name_message('suffix', path.suffix, FORMATS)}")
    if path.suffix == ".parquet":
        stream = io.BytesIO()
        pq.write_table(table, stream, compression="zstd")
        content = stream.getvalue()
    elif path.suffix == ".jsonl":
        content = "".join(json.dumps(row, ensure_ascii=False) + "\n" for row in table.to_pylist()).encode()
    else:
        text = io.StringIO()
        writer = csv.DictWriter(text, table.column_names, lineterminator="\n")
        writer.writeheader()
        writer.writerows(table.to_pylist())
        content = text.getvalue().encode()
    write_bytes_atomically(path, content)
