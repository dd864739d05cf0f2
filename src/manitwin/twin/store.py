"""Twin folders: written whole or not at all, read with their digests checked."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from manitwin.errors import TwinError
from manitwin.twin.record import SCHEMA_VERSION, TwinRecord

RECORD = "twin.json"
RUN = "run.json"
WORK = ".work"


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
    """Give a path in the same folder; what is written there takes its place when the block ends well, else it is removed."""
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
    whole = TwinRecord(**record, revision="").model_dump(mode="json")
    whole["revision"] = revision_of(whole)
    write_bytes_atomically(folder / RECORD, canonical_json(whole).encode())
    return TwinRecord(**whole)


def amend(folder: Path, files: dict[str, bytes]) -> TwinRecord:
    """Give a finished twin new content of some of its files: each is renamed over the old one, twin.json last.

    The record gets their digests and a new revision; nothing else in it changes. A crash in between leaves a twin whose
    digests do not match, which ``verify_record`` says. Raises TwinError where the twin has no such file.
    """
    record = read_record(folder).model_dump(mode="json")
    unknown = files.keys() - record["files"].keys()
    if unknown:
        raise TwinError(f"{folder}: the twin has no {', '.join(sorted(unknown))}; it has {', '.join(record['files'])}")
    for name, content in sorted(files.items()):
        write_bytes_atomically(folder / name, content)
        record["files"][name] = hashlib.sha256(content).hexdigest()
    record["revision"] = revision_of(record)
    write_bytes_atomically(folder / RECORD, canonical_json(record).encode())
    return TwinRecord(**record)


def read_record(folder: Path, verify: bool = False) -> TwinRecord:
    """Read twin.json; with ``verify``, also check its revision and the digest of every file it names.

    Raises TwinError naming the file, the cause and the remedy.
    """
    path = folder / RECORD
    if not path.is_file():
        raise TwinError(f"{folder}: no {RECORD}, so this is no finished twin; give a folder that `manitwin build` made")
    content = path.read_bytes()
    record = parse_record(content, path)
    if verify:
        verify_record(folder, record)
    return record


def parse_record(content: bytes, path: str | Path = RECORD) -> TwinRecord:
    """Read the content of a twin.json; raises TwinError naming ``path``, the cause and the remedy."""
    try:
        data = json.loads(content)
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise TwinError(f"{path}: not JSON ({error}); build the twin again") from error
    if not isinstance(data, dict) or data.get("schema_version") != SCHEMA_VERSION:
        version = data.get("schema_version") if isinstance(data, dict) else None
        raise TwinError(f"{path}: schema version {version}, this package reads {SCHEMA_VERSION}; build the twin again")
    try:
        return TwinRecord(**data)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise TwinError(f"{path}: {where}: {first['msg']}; build the twin again") from error


def verify_record(folder: Path, record: TwinRecord) -> None:
    """Check the revision of a folder's record and the digest of every file that it names; raises TwinError."""
    if revision_of(json.loads((folder / RECORD).read_bytes())) != record.revision:
        raise TwinError(
            f"{folder / RECORD}: altered since it was written (its revision does not match); build the twin again"
        )
    for name, digest in record.files.items():
        path = folder / name
        if not path.is_file():
            raise TwinError(f"{path}: missing, though {RECORD} names it; build the twin again")
        if sha256_of_file(path) != digest:
            raise TwinError(f"{path}: altered since it was written (its sha256 does not match); build the twin again")
