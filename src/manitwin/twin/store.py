"""Twin folders: written atomically, and read with their digests checked."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from manitwin.errors import NewerVersion, TwinError, UsageError
from manitwin.formats.bounded_file import open_regular, read_bytes
from manitwin.formats.json_file import MAX_JSON_BYTES, parse_json_object, read_json_object
from manitwin.formats.printable import printable, printable_line
from manitwin.formats.schema_version import is_newer, newer_schema_message
from manitwin.twin.folder_check import require_regular_folder
from manitwin.twin.migration import SCHEMA_VERSION, migrate_record
from manitwin.twin.record import TwinRecord
from manitwin.twin.record_values import CONTROLS

RECORD = "twin.json"
RUN = "run.json"
WORK = ".work"
MAX_TWIN_FILE_BYTES = 5 << 30
"""The largest file is the source: ``packed_source.MAX_KEPT_BYTES`` plus the overhead of an archive."""
REMEDY = "build the twin again"
_SHOWN_CHARACTERS = 120
_BLOCK_BYTES = 1 << 20


def canonical_json(value: Any) -> str:
    """Return canonical JSON, the same text for equal values: sorted keys, no NaN or infinity."""
    return json.dumps(value, sort_keys=True, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def sha256_of_json(value: Any) -> str:
    """Return the hex SHA-256 of a JSON value."""
    return hashlib.sha256(canonical_json(value).encode()).hexdigest()


def sha256_of_file(path: Path) -> str:
    """Return the hex SHA-256 of a file."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def sha256_of_untrusted(path: Path, inside: Path) -> str:
    """Return the hex SHA-256 of a regular file below a folder. Raises TwinError for special files, outside links and excess
    size.
    """
    digest = hashlib.sha256()
    with open_regular(path, TwinError, inside=inside, name=str(path)) as stream:
        size = os.fstat(stream.fileno()).st_size
        if size > MAX_TWIN_FILE_BYTES:
            raise TwinError(
                f"{path}: {size} bytes exceed the size limit of a twin's file ({MAX_TWIN_FILE_BYTES}); {REMEDY}"
            )
        while block := stream.read(_BLOCK_BYTES):
            digest.update(block)
    return digest.hexdigest()


def digests_below(folder: Path) -> dict[str, str]:
    """Return ``{relative name: sha256}`` of every file below a folder, sorted by name."""
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    return {p.relative_to(folder).as_posix(): sha256_of_file(p) for p in files}


def sha256_of_artifact(path: Path) -> str:
    """Return the digest of a file, or of the names and contents of a folder."""
    return sha256_of_json(digests_below(path)) if path.is_dir() else sha256_of_file(path)


def write_bytes_atomically(path: Path, content: bytes) -> None:
    """Write a file atomically: to a temporary file in the same folder, which is then renamed."""
    with atomic_file(path) as beside:
        beside.write_bytes(content)


@contextmanager
def atomic_file(place: Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder; on success it replaces ``place``, on an exception it is removed.

    Raises UsageError if ``place`` is a folder.
    """
    if place.is_dir():
        raise UsageError(f"{place}: is a folder, but a file must be written there; move the folder away")
    place.parent.mkdir(parents=True, exist_ok=True)
    beside = place.with_name(f".{place.name}.{os.getpid()}")
    try:
        yield beside
        with beside.open("rb") as stream:
            os.fsync(stream.fileno())
        os.replace(beside, place)
    finally:
        beside.unlink(missing_ok=True)


@contextmanager
def atomic_folder(place: Path) -> Iterator[Path]:
    """Yield an empty temporary folder beside ``place``; on success it replaces ``place``, on an exception it is removed."""
    beside = place.with_name(f".{place.name}.{os.getpid()}")
    shutil.rmtree(beside, ignore_errors=True)
    beside.mkdir(parents=True)
    try:
        yield beside
        replace_folder(beside, place)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def replace_folder(new: Path, place: Path) -> None:
    """Rename a finished folder into place; an older folder there is first moved aside and then deleted.

    Both must be on one file system. After a crash either the old or the new folder is in place, or neither, with the old one
    kept as ``<name>.replaced`` beside ``new``; the next run then starts over.
    """
    aside = new.with_name(f"{place.name}.replaced")
    shutil.rmtree(aside, ignore_errors=True)
    if place.exists():
        os.rename(place, aside)
    place.parent.mkdir(parents=True, exist_ok=True)
    os.rename(new, place)
    shutil.rmtree(aside, ignore_errors=True)


def revision_of(record: dict[str, Any]) -> str:
    """Return the hash of a twin.json without its ``revision``."""
    return sha256_of_json({key: value for key, value in record.items() if key != "revision"})


def write_twin_record(folder: Path, record: dict[str, Any]) -> TwinRecord:
    """Add file digests and the revision to a record, validate it, and write twin.json.

    Raises pydantic.ValidationError if the record violates the schema, which is a bug.
    """
    digests = digests_below(folder)
    record = {**record, "files": {n: d for n, d in digests.items() if n not in (RECORD, RUN)}}
    whole = _escape_controls(TwinRecord(**record, revision="").model_dump(mode="json"))
    whole["revision"] = revision_of(whole)
    write_bytes_atomically(folder / RECORD, canonical_json(whole).encode())
    return TwinRecord(**whole)


def _escape_controls(value: Any) -> Any:
    """Return a JSON value with control characters in its texts escaped, as model answers and file names may contain them."""
    if isinstance(value, str):
        return CONTROLS.sub(lambda found: printable(found[0]), value)
    if isinstance(value, dict):
        return {_escape_controls(key): _escape_controls(each) for key, each in value.items()}
    return [_escape_controls(each) for each in value] if isinstance(value, list) else value


def _find_controls(value: Any) -> str | None:
    """Return an excerpt of a text in a JSON value that contains control characters; None if there is none."""
    left = [value]
    while left:
        each = left.pop()
        if isinstance(each, str) and (found := CONTROLS.search(each)):
            return each[max(0, found.start() - 20) : found.end() + 20]
        if isinstance(each, dict):
            left += [*each.keys(), *each.values()]
        elif isinstance(each, list):
            left += each
    return None


def replace_files(
    folder: Path, files: dict[str, bytes], note: Callable[[dict[str, int]], None] = lambda sizes: None
) -> TwinRecord:
    """Replace the content of some files of a finished twin; each is written atomically, twin.json last.

    The record gets the new digests and a new revision; nothing else in it changes. ``note`` is called with the new sizes before
    twin.json is written. After a crash in between, digests do not match, which ``verify_record`` reports. Raises TwinError if
    the twin has no such file.
    """
    record = read_record(folder).model_dump(mode="json")
    unknown = files.keys() - record["files"].keys()
    if unknown:
        raise TwinError(f"{folder}: the twin has no {', '.join(sorted(unknown))}; it has {', '.join(record['files'])}")
    for name, content in sorted(files.items()):
        write_bytes_atomically(folder / name, content)
        record["files"][name] = hashlib.sha256(content).hexdigest()
    record["revision"] = revision_of(record)
    amended = canonical_json(record).encode()
    note({**{name: len(content) for name, content in files.items()}, RECORD: len(amended)})
    write_bytes_atomically(folder / RECORD, amended)
    return TwinRecord(**record)


def read_record(folder: Path, verify: bool = False) -> TwinRecord:
    """Read twin.json; with ``verify``, also check its revision and the digest of every file it names.

    Raises TwinError with file, cause and remedy.
    """
    path = folder / RECORD
    if not os.path.lexists(path):
        remedy = "give a folder that `manitwin build` made"
        if (folder / "twins").is_dir():
            remedy = (
                "this is a data set: open it with `manitwin view` or manitwin.Dataset, or give a folder below twins/"
            )
        raise TwinError(f"{folder}: no {RECORD}, so this is not a finished twin; {remedy}")
    require_regular_folder(folder)
    content = read_bytes(path, MAX_JSON_BYTES, TwinError, inside=folder, name=str(path))
    record = parse_record(content, path)
    if verify:
        verify_record(folder, record)
    return record


def parse_record(content: bytes, path: str | Path = RECORD, *, sealed: bool = False) -> TwinRecord:
    """Parse the content of a twin.json; with ``sealed``, check its revision. Raises TwinError with ``path``.

    A record of an earlier schema version is migrated; its ``revision`` stays that of the file.
    """
    said = parse_json_object(content, str(path), TwinError, remedy=REMEDY)
    data = migrate_content(said, path)
    if (found := _find_controls(data)) is not None:
        raise TwinError(f"{path}: {printable_line(found)!r} contains control characters; {REMEDY}")
    if sealed and revision_of(said) != said.get("revision"):
        raise TwinError(f"{path}: altered since it was written (its revision does not match); {REMEDY}")
    try:
        return TwinRecord(**data)
    except ValidationError as error:
        first = error.errors()[0]
        where = printable_line(".".join(map(str, first["loc"])), max_characters=_SHOWN_CHARACTERS)
        raise TwinError(f"{path}: {where}: {first['msg']}; {REMEDY}") from error


def migrate_content(said: dict[str, Any], path: str | Path) -> dict[str, Any]:
    """Return the content of a twin.json in the current schema version. Raises TwinError with ``path`` for an unknown version.

    A version newer than this package raises NewerVersion.
    """
    data = migrate_record(said)
    if is_newer(data.get("schema_version"), SCHEMA_VERSION):
        raise NewerVersion(newer_schema_message(path, data["schema_version"], SCHEMA_VERSION))
    if data.get("schema_version") != SCHEMA_VERSION:
        version = printable_line(str(data.get("schema_version")), max_characters=_SHOWN_CHARACTERS)
        raise TwinError(f"{path}: schema version {version}, this package reads 1 to {SCHEMA_VERSION}; {REMEDY}")
    return data


def verify_record(folder: Path, record: TwinRecord) -> None:
    """Check the revision of a folder's record and the digest of every file it names. Raises TwinError."""
    said = read_json_object(folder / RECORD, TwinError, inside=folder, name=str(folder / RECORD), remedy=REMEDY)
    if revision_of(said) != record.revision:
        raise TwinError(f"{folder / RECORD}: altered since it was written (its revision does not match); {REMEDY}")
    for name, digest in record.files.items():
        path = folder / name
        if not os.path.lexists(path):
            raise TwinError(f"{path}: missing, though {RECORD} names it; {REMEDY}")
        if sha256_of_untrusted(path, folder) != digest:
            raise TwinError(f"{path}: altered since it was written (its sha256 does not match); {REMEDY}")
