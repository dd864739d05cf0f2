"""Twin folders: written whole or not at all, read with their digests checked."""

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
from manitwin.formats.schema_version import is_newer, of_newer_schema
from manitwin.twin.migration import SCHEMA_VERSION, migrated
from manitwin.twin.record import TwinRecord
from manitwin.twin.record_values import CONTROLS
from manitwin.twin.twin_files import require_plain

RECORD = "twin.json"
RUN = "run.json"
WORK = ".work"
MAX_TWIN_FILE_BYTES = 5 << 30
"""Its source is the largest: ``packed_source.MAX_KEPT_BYTES``, and what an archive adds."""
REMEDY = "build the twin again"
_SHOWN_CHARACTERS = 120
_BLOCK_BYTES = 1 << 20


def canonical_json(value: Any) -> str:
    """Return JSON that is the same text for equal values: sorted keys, no NaN or infinity."""
    return json.dumps(value, sort_keys=True, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def sha256_of_json(value: Any) -> str:
    """Return the hex digest of a JSON value."""
    return hashlib.sha256(canonical_json(value).encode()).hexdigest()


def sha256_of_file(path: Path) -> str:
    """Return the hex digest of a file's bytes."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def sha256_of_untrusted(path: Path, inside: Path) -> str:
    """Return the hex digest of a regular file of a twin's size below a folder; raises TwinError for anything else."""
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
    """Return the digest of a file, or of a folder's names and contents."""
    return sha256_of_json(digests_below(path)) if path.is_dir() else sha256_of_file(path)


def write_bytes_atomically(path: Path, content: bytes) -> None:
    """Write a file beside its place and rename it there, so that nobody ever reads half of it."""
    with file_beside(path) as beside:
        beside.write_bytes(content)


@contextmanager
def file_beside(place: Path) -> Iterator[Path]:
    """Give a path in the same folder; what is written there takes its place when the block ends well, else it is removed.

    Raises UsageError where a folder is in its place.
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
def folder_beside(place: Path) -> Iterator[Path]:
    """Give an empty folder beside a place; it takes that place when the block ends well, else it is removed."""
    beside = place.with_name(f".{place.name}.{os.getpid()}")
    shutil.rmtree(beside, ignore_errors=True)
    beside.mkdir(parents=True)
    try:
        yield beside
        replace_folder(beside, place)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def replace_folder(new: Path, place: Path) -> None:
    """Rename a finished folder into place; an older one there steps aside first and is then deleted.

    Both must be on one file system. A crash in between leaves either the old or the new one whole, or neither in place
    with the old one under ``<name>.replaced`` beside ``new``, from where the next run starts afresh.
    """
    aside = new.with_name(f"{place.name}.replaced")
    shutil.rmtree(aside, ignore_errors=True)
    if place.exists():
        os.rename(place, aside)
    place.parent.mkdir(parents=True, exist_ok=True)
    os.rename(new, place)
    shutil.rmtree(aside, ignore_errors=True)


def revision_of(record: dict[str, Any]) -> str:
    """Return the hash of twin.json without its ``revision``."""
    return sha256_of_json({key: value for key, value in record.items() if key != "revision"})


def seal(folder: Path, record: dict[str, Any]) -> TwinRecord:
    """Add the digests of the folder's files and the revision to a record, validate it, and write twin.json.

    Raises pydantic.ValidationError where the record breaks the schema: that is a defect, not an input.
    """
    digests = digests_below(folder)
    record = {**record, "files": {n: d for n, d in digests.items() if n not in (RECORD, RUN)}}
    whole = _plain(TwinRecord(**record, revision="").model_dump(mode="json"))
    whole["revision"] = revision_of(whole)
    write_bytes_atomically(folder / RECORD, canonical_json(whole).encode())
    return TwinRecord(**whole)


def _plain(value: Any) -> Any:
    """Return a JSON value whose texts hold no control characters: a model's answer or the name of a file may."""
    if isinstance(value, str):
        return CONTROLS.sub(lambda found: printable(found[0]), value)
    if isinstance(value, dict):
        return {_plain(key): _plain(each) for key, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, list) else value


def _with_controls(value: Any) -> str | None:
    """Return the beginning of a text in a JSON value that contains control characters, None where none does."""
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


def amend(
    folder: Path, files: dict[str, bytes], note: Callable[[dict[str, int]], None] = lambda sizes: None
) -> TwinRecord:
    """Give a finished twin new content of some of its files: each is renamed over the old one, twin.json last.

    The record gets their digests and a new revision; nothing else in it changes. ``note`` is told the new sizes before
    twin.json is written. A crash in between leaves a twin whose digests do not match, which ``verify_record`` says. Raises
    TwinError where the twin has no such file.
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

    Raises TwinError naming the file, the cause and the remedy.
    """
    path = folder / RECORD
    if not os.path.lexists(path):
        remedy = "give a folder that `manitwin build` made"
        if (folder / "twins").is_dir():
            remedy = (
                "this is a data set: open it with `manitwin view` or manitwin.Dataset, or give a folder below twins/"
            )
        raise TwinError(f"{folder}: no {RECORD}, so this is not a finished twin; {remedy}")
    require_plain(folder)
    content = read_bytes(path, MAX_JSON_BYTES, TwinError, inside=folder, name=str(path))
    record = parse_record(content, path)
    if verify:
        verify_record(folder, record)
    return record


def parse_record(content: bytes, path: str | Path = RECORD, *, sealed: bool = False) -> TwinRecord:
    """Read the content of a twin.json, with ``sealed`` one that its revision is of; raises TwinError naming ``path``.

    A record of an earlier schema version is brought to this one; its ``revision`` stays that of the file.
    """
    said = parse_json_object(content, str(path), TwinError, remedy=REMEDY)
    data = in_present_version(said, path)
    if (found := _with_controls(data)) is not None:
        raise TwinError(f"{path}: {printable_line(found)!r} contains control characters; {REMEDY}")
    if sealed and revision_of(said) != said.get("revision"):
        raise TwinError(f"{path}: altered since it was written (its revision does not match); {REMEDY}")
    try:
        return TwinRecord(**data)
    except ValidationError as error:
        first = error.errors()[0]
        where = printable_line(".".join(map(str, first["loc"])), max_characters=_SHOWN_CHARACTERS)
        raise TwinError(f"{path}: {where}: {first['msg']}; {REMEDY}") from error


def in_present_version(said: dict[str, Any], path: str | Path) -> dict[str, Any]:
    """Return the content of a twin.json in the present schema version; raises TwinError naming ``path`` for one not known.

    One of a newer version of this package raises NewerVersion.
    """
    data = migrated(said)
    if is_newer(data.get("schema_version"), SCHEMA_VERSION):
        raise NewerVersion(of_newer_schema(path, data["schema_version"], SCHEMA_VERSION))
    if data.get("schema_version") != SCHEMA_VERSION:
        version = printable_line(str(data.get("schema_version")), max_characters=_SHOWN_CHARACTERS)
        raise TwinError(f"{path}: schema version {version}, this package reads 1 to {SCHEMA_VERSION}; {REMEDY}")
    return data


def verify_record(folder: Path, record: TwinRecord) -> None:
    """Check the revision of a folder's record and the digest of every file that it names; raises TwinError."""
    said = read_json_object(folder / RECORD, TwinError, inside=folder, name=str(folder / RECORD), remedy=REMEDY)
    if revision_of(said) != record.revision:
        raise TwinError(f"{folder / RECORD}: altered since it was written (its revision does not match); {REMEDY}")
    for name, digest in record.files.items():
        path = folder / name
        if not os.path.lexists(path):
            raise TwinError(f"{path}: missing, though {RECORD} names it; {REMEDY}")
        if sha256_of_untrusted(path, folder) != digest:
            raise TwinError(f"{path}: altered since it was written (its sha256 does not match); {REMEDY}")
