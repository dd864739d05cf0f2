"""Parsing of external lists (CSV, JSONL): each entry becomes a validated record or a cause of refusal."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from manitwin.dataset.collect.facts import UNKNOWN
from manitwin.dataset.collect.listings import LICENCES, is_listing, read_listing
from manitwin.errors import UsageError
from manitwin.formats.csv_file import read_csv, read_lines
from manitwin.formats.json_file import parse_json
from manitwin.formats.printable import printable_line
from manitwin.pipeline.manifest_item import unusable

COLUMNS = ("file", "url", "name", "source", "license", "attribution", "size_m")
"""Columns that are read; ``path``, ``category`` and ``licence`` are synonyms of file, name and license."""
OTHER_NAMES = {"path": "file", "category": "name", "licence": "license"}
LONGEST_URL = 2048
LARGEST_SIZE_M = 100.0
_UNSAID = frozenset({"", "none", "null", "n/a", "todo", "?", UNKNOWN})


class EntryError(Exception):
    """An entry that cannot become a row. The message is a cause worded without details, so that entries with it can
    be counted.
    """


@dataclass(frozen=True)
class ListEntry:
    """Values of a list entry: ``file`` as written there, or ``url``; None for values that are not stated."""

    file: str | None
    url: str | None
    name: str | None
    source: str | None
    licence: str | None
    attribution: str | None
    size_m: float | None


def read_list(path: Path, *, files: bool = False) -> Iterator[tuple[int, ListEntry | EntryError]]:
    """Yield the line number and entry of each row of a list; raises UsageError if the file as a whole is malformed.

    ``files`` makes the entries of a data set's listing refer to files instead of URLs. A malformed JSON line invalidates only
    that row. A CSV with an unclosed quote fails as a whole, since the rows after it cannot be trusted.
    """
    for line, row in _rows(path, files=files):
        try:
            if isinstance(row, EntryError):
                raise row
            yield line, _parse_entry(row)
        except EntryError as cause:
            yield line, cause


def _rows(path: Path, *, files: bool) -> Iterator[tuple[int, Mapping[str, Any] | EntryError]]:
    if is_listing(path):
        yield from read_listing(path, files=files)
        return
    if path.suffix.lower() == ".csv":
        yield from read_csv(path, UsageError)
        return
    for number, line in enumerate(read_lines(path, UsageError), 1):
        if not line.strip():
            continue
        try:
            row = parse_json(line, "row", EntryError)
        except EntryError:
            yield number, EntryError("the line is not valid JSON")
            continue
        yield number, row if isinstance(row, dict) else EntryError("the line is not a JSON object")


def _parse_entry(row: Mapping[str, Any]) -> ListEntry:
    values = {column: _text(row, column) for column in COLUMNS if column != "size_m"}
    file, url = values["file"], values["url"]
    if (file is None) == (url is None):
        raise EntryError("has neither a file nor a url" if file is None else "has both a file and a url")
    if url is not None:
        _check_url(url)
    return ListEntry(
        file=file,
        url=url,
        name=values["name"],
        source=values["source"],
        licence=licence_or_none(values["license"]),
        attribution=values["attribution"],
        size_m=_size(row.get("size_m")),
    )


def licence_or_none(text: str | None) -> str | None:
    """Return the SPDX identifier of a known licence, other licences as written, and None for placeholder words."""
    if text is None or text.strip().lower() in _UNSAID:
        return None
    return LICENCES.get(text.strip().lower(), text.strip())


def _text(row: Mapping[str, Any], column: str) -> str | None:
    names = (column, *(other for other, meant in OTHER_NAMES.items() if meant == column))
    value = next((row[name] for name in names if row.get(name) not in (None, "")), None)
    if value is None:
        return None
    if not isinstance(value, str):
        raise EntryError(f"{column} is not a text")
    text = value.strip()
    if column != "url" and (why := unusable(column if column != "source" else "name", text)):
        raise EntryError(f"{column} {'is too long' if 'characters; give at most' in why else 'has control characters'}")
    return text or None


def _check_url(url: str) -> None:
    if len(url) > LONGEST_URL:
        raise EntryError("url is too long")
    if not url.isascii() or not url.isprintable() or " " in url:
        raise EntryError("url has invalid characters; encode them as %XX")
    try:
        parts = urlsplit(url)
        wrong = parts.scheme not in ("http", "https") or not parts.hostname
        secret = parts.username is not None or parts.password is not None
    except ValueError:
        wrong, secret = True, False
    if wrong:
        raise EntryError("url is not http or https")
    if secret:
        raise EntryError("url contains a user name or password")


def _size(value: Any) -> float | None:
    if value is None or value == "":
        return None
    try:
        size = math.nan if isinstance(value, bool) or not isinstance(value, str | int | float) else float(value)
    except (ValueError, OverflowError):
        size = math.nan
    if not 0 < size <= LARGEST_SIZE_M:
        raise EntryError(f"size_m is not a length in metres, above 0 and at most {LARGEST_SIZE_M:g}")
    return size


def line_location(path: Path, line: int) -> str:
    """Return the location ``file:line`` of an entry for messages."""
    return printable_line(f"{path}:{line}", max_characters=200)
