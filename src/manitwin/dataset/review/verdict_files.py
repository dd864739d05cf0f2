"""External verdicts in CSV or JSONL files, and the empty form to fill in."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from manitwin.dataset.review.review_subjects import annotation_text, check_corrections, prompts_of, read_twin
from manitwin.dataset.review.verdict_table import SCHEMA
from manitwin.dataset.review.verdicts import DIMENSIONS, Review, reason_of
from manitwin.errors import UsageError, unknown_name_message
from manitwin.formats.csv_file import read_csv, read_lines
from manitwin.formats.json_file import parse_json_object
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import write_bytes_atomically

READ = (".csv", ".jsonl")
SAID = "said"
"""Form column with the twin's annotations for the person who fills it in; it is not read back."""
COLUMNS = (*SCHEMA.names, SAID)
_FORM = (
    "twin_id", "revision", "annotator", "dimension", SAID, "answer", "category", "mass_kg", "mass_low_kg", "mass_high_kg",
    "longest_side_m", "points", "note",
)  # fmt: skip
MOST_ROWS = 1_000_000


def write_form(path: Path, root: DatasetRoot, twin_ids: Iterable[str], annotator: str) -> int:
    """Write a CSV form with one row per twin and dimension, answers left blank; return the number of rows."""
    text = io.StringIO()
    writer = csv.DictWriter(text, _FORM, lineterminator="\n")
    writer.writeheader()
    rows = 0
    for twin_id in twin_ids:
        record = read_twin(root, twin_id)
        for dimension in DIMENSIONS:
            row = {"twin_id": twin_id, "revision": record.revision, "annotator": annotator, "dimension": dimension}
            writer.writerow({**row, SAID: annotation_text(record, dimension)})
            rows += 1
    write_bytes_atomically(path, text.getvalue().encode())
    return rows


def read_verdicts(path: Path, root: DatasetRoot) -> list[tuple[Review, str]]:
    """Read external reviews, each with an id derived from its content, so that a file that is read again adds nothing.

    Rows of one annotator on one twin form one review. An empty ``revision`` means the twin's current one; ``prompt`` is taken
    from the twin if the revision is current. Raises UsageError naming the line for an invalid verdict or a twin that is not
    accepted.
    """
    if path.suffix not in READ:
        raise UsageError(f"{path}: {unknown_name_message('suffix', path.suffix, READ)}")
    given: dict[tuple[str, str, str], list[tuple[int, dict[str, str]]]] = {}
    for count, (line, row) in enumerate(_read_rows(path)):
        if count == MOST_ROWS:
            raise UsageError(f"{path}: more than {MOST_ROWS:,} rows; split the file")
        for name in row:
            if name not in COLUMNS:
                raise UsageError(f"{path}:{line}: {unknown_name_message('column', name, COLUMNS)}")
        if SAID in row and not str(row.get("answer") or "").strip():
            continue  # an unanswered row of the form
        said = {name: _as_text(value) for name, value in row.items() if value not in (None, "")}
        if missing := [name for name in ("twin_id", "annotator", "dimension", "answer") if not said.get(name)]:
            raise UsageError(
                f"{path}:{line}: no {missing[0]}; every row needs twin_id, annotator, dimension and answer"
            )
        key = said["twin_id"], said["annotator"], said.get("revision", "")
        given.setdefault(key, []).append((line, said))
    if not given:
        raise UsageError(f"{path}: the file has no verdicts; give a header and rows, or one JSON object per line")
    return [_review(path, root, rows) for rows in given.values()]


def _read_rows(path: Path) -> Iterator[tuple[int, Mapping[str, Any]]]:
    if path.suffix == ".csv":
        yield from read_csv(path, UsageError)
        return
    for number, line in enumerate(read_lines(path, UsageError), 1):
        if line.strip():
            yield number, parse_json_object(line, f"{path}:{number}", UsageError)


def _as_text(value: Any) -> str:
    return str(value).strip()


def _review(path: Path, root: DatasetRoot, rows: list[tuple[int, dict[str, str]]]) -> tuple[Review, str]:
    first_line, first = rows[0]
    try:
        record = read_twin(root, first["twin_id"])
    except UsageError as error:
        raise UsageError(f"{path}:{first_line}: {error}") from error
    body: dict[str, Any] = {
        "annotator": first["annotator"], "twin_id": record.twin_id, "revision": first.get("revision", record.revision),
        "answers": {}, "corrections": {}, "origin": "file",
    }  # fmt: skip
    for line, said in rows:
        where = f"{path}:{line}"
        if said["dimension"] in body["answers"]:
            raise UsageError(
                f"{where}: {said['dimension']} of {record.twin_id} is answered twice by {said['annotator']}; keep"
                f" one line"
            )
        body["answers"][said["dimension"]] = said["answer"]
        body["corrections"] |= _corrections(said, where, body["corrections"])
        for name in ("note", "seconds"):
            if name in said:
                body[name] = _number(said, name, where) if name == "seconds" else said[name]
        body["blind"] = body.get("blind", False) or said.get("blind", "").lower() in ("true", "1", "yes")
    if body["revision"] == record.revision:
        body["prompts"] = prompts_of(record)
    try:
        review = Review.model_validate(body)
        if review.revision == record.revision:
            check_corrections(record, review.corrections)
    except ValidationError as error:
        raise UsageError(f"{path}:{first_line}: {reason_of(error)}") from error
    except UsageError as error:
        raise UsageError(f"{path}:{first_line}: {error}") from error
    said_by_them = review.model_dump_json(exclude={"prompts"})
    return review, f"file:{hashlib.sha256(said_by_them.encode()).hexdigest()}"


def _corrections(said: Mapping[str, str], where: str, before: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {"category": said["category"]} if "category" in said else {}
    for name, stem, unit in (("mass_kg", "mass", "kg"), ("longest_side_m", "longest_side", "m")):
        if name in said:
            value = _number(said, name, where)
            low, high = f"{stem}_low_{unit}", f"{stem}_high_{unit}"
            ends = [_number(said, end, where) if end in said else value for end in (low, high)]
            found[name] = {"value": value, "low": ends[0], "high": ends[1]}
    if "points" in said:
        found["points"] = {**before.get("points", {}), **_points(said["points"], where)}
    return found


def _points(text: str, where: str) -> dict[str, int]:
    found = {}
    for part in filter(None, (each.strip() for each in text.split(";"))):
        point, equals, candidate = part.partition("=")
        if not equals or not candidate.strip().isascii() or not candidate.strip().isdigit() or len(candidate) > 9:
            raise UsageError(f"{where}: points {text[:60]!r}; give them as 'f0=12;g1=3', point and candidate")
        found[point.strip()] = int(candidate)
    return found


def _number(said: Mapping[str, str], name: str, where: str) -> float:
    try:
        return float(said[name])
    except ValueError:
        raise UsageError(f"{where}: {name} is {said[name][:40]!r}, which is not a number; give a number") from None
