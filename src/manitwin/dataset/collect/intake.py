"""Adding inputs to a catalogue: every file of a folder or entry of a list becomes either a row or a counted refusal."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from manitwin.dataset.collect.facts import UNKNOWN, infer_facts, name_of_file, size_band_of
from manitwin.dataset.collect.list_parsing import (
    EntryError,
    ListEntry,
    licence_or_none,
    line_location,
    read_list,
)
from manitwin.dataset.collect.place_check import require_place
from manitwin.dataset.collect.store import Catalogue, Kind, Refused, Row
from manitwin.errors import UsageError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.printable import printable_line
from manitwin.formats.source_files import IMAGE_SUFFIXES, MESH_SUFFIXES
from manitwin.pipeline.folder_listing import list_folder
from manitwin.pipeline.manifest_item import unusable
from manitwin.twin.import_record import IMPORTED_MESH

MAX_INPUT_BYTES = 1 << 30
"""Size limit of an input file; larger files are neither hashed nor planned. Photos and meshes of one object are far smaller."""
BATCH = 500
"""Rows per transaction, and so the most that are read again after an interruption."""
_CAUSE_CHARACTERS, _CAUSES = 200, 1000


@dataclass(frozen=True)
class DefaultValues:
    """Values from the command line for all inputs; values of a list entry take precedence."""

    source: str | None = None
    licence: str | None = None
    attribution: str | None = None
    name: str | None = None


@dataclass
class IntakeSummary:
    """Outcome for the entries of one folder or list: new, changed and unchanged rows, and entries that became no row."""

    new: int = 0
    changed: int = 0
    unchanged: int = 0
    repeated: int = 0
    """Entries whose place an earlier entry has named."""
    unreadable: dict[str, int] = field(default_factory=dict)
    refused: list[Refused] = field(default_factory=list)
    parts: int = 0
    """Files that are textures or materials of another input."""

    @property
    def entries(self) -> int:
        """Number of entries, each counted once; unreadable rows are counted among new, changed and unchanged."""
        return self.new + self.changed + self.unchanged + self.repeated + sum(r.count for r in self.refused)


def add_inputs(catalogue: Path, given_place: Path, given: DefaultValues, root: Path | None = None) -> IntakeSummary:
    """Add a folder of photos and meshes, or a CSV or JSONL list, to a catalogue, which is created if missing.

    The files of a list are relative to ``root``, by default the folder of the list. For the published listing of a data set,
    entries refer to files only if ``root`` is given, else to their URLs. Raises UsageError for any other place, for a list that
    is malformed as a whole (nothing of it is added), and if the source is not stated.
    """
    _require_valid_defaults(given)
    require_place(given_place, given.source, root)
    listing = not given_place.is_dir()
    if listing and not _rows_of(given_place, files=root is not None):
        raise UsageError(f"{given_place}: the list has no rows; it needs a column 'file' or 'url'")
    with Catalogue(catalogue, make=True) as store:
        below = (root or given_place.parent) if listing else given_place
        return _Intake(store, given_place, given, below, files=root is not None).run()


def _require_valid_defaults(given: DefaultValues) -> None:
    for option, column, value in (
        ("source", "name", given.source),
        ("licence", "license", given.licence),
        ("attribution", "attribution", given.attribution),
        ("category", "name", given.name),
    ):
        if value is not None and (why := unusable(column, value)):
            raise UsageError(f"--{option}: {why}")


def _rows_of(path: Path, *, files: bool) -> int:
    """Return the number of rows of a list. It reads the whole list first, so that nothing of a malformed list is added."""
    return sum(1 for _ in read_list(path, files=files))


class _Intake:
    """Adds one folder or list to a catalogue."""

    def __init__(self, store: Catalogue, place: Path, given: DefaultValues, root: Path, *, files: bool):
        self._store, self._place, self._given, self._files = store, place, given, files
        self._root = Path(os.path.realpath(root))
        self._causes: dict[str, tuple[int, str]] = {}
        self._seen: set[str] = set()
        self._added = IntakeSummary()

    def run(self) -> IntakeSummary:
        entries = self._folder() if self._place.is_dir() else self._list()
        while batch := list(islice(entries, BATCH)):
            self._put(batch)
        name = _utf8(os.path.realpath(self._place)) or printable_line(os.path.realpath(self._place))
        refused = [Refused(name, cause, count, first) for cause, (count, first) in sorted(self._causes.items())]
        self._store.finish(name, refused)
        self._added.refused = sorted(refused, key=lambda r: (-r.count, r.cause))
        return self._added

    def _refuse(self, cause: str, example: str) -> None:
        cause = printable_line(cause, max_characters=_CAUSE_CHARACTERS)
        if cause not in self._causes and len(self._causes) >= _CAUSES:
            cause = "another cause"
        count, first = self._causes.get(cause, (0, printable_line(example, max_characters=_CAUSE_CHARACTERS)))
        self._causes[cause] = (count + 1, first)

    def _folder(self) -> Iterator[Row]:
        listing = list_folder(self._place)
        self._added.parts = len(listing.parts)
        for file, cause in listing.left.items():
            self._refuse(cause, str(file))
        for file in listing.inputs:
            path = os.path.realpath(file.parent) + os.sep + file.name
            name = self._given.name or name_of_file(file.stem, file.parent.name)
            row = self._row(ListEntry(path, None, name, None, None, None, None), str(file))
            if row is not None:
                yield row

    def _list(self) -> Iterator[Row]:
        for line, listed in read_list(self._place, files=self._files):
            example = line_location(self._place, line)
            if isinstance(listed, EntryError):
                self._refuse(str(listed), example)
            elif not (listed.source or self._given.source):
                self._refuse("has no source; give a column 'source', or --source", example)
            elif (row := self._row(listed, example)) is not None:
                yield row

    def _row(self, listed: ListEntry, example: str) -> Row | None:
        place = listed.url or os.path.normpath(os.path.join(self._root, listed.file or ""))
        if _utf8(place) is None:
            self._refuse("its name is not UTF-8; rename the file", example)
            return None
        if place in self._seen:
            self._added.repeated += 1
            return None
        kind = _kind(place) if listed.url is None else "url"
        if kind is None:
            self._refuse(
                f"is not an image or a mesh; known: {', '.join(sorted(IMAGE_SUFFIXES | MESH_SUFFIXES))}", example
            )
            return None
        self._seen.add(place)
        facts = infer_facts(listed.name or self._given.name, listed.size_m)
        return Row(
            place=place,
            kind=kind,
            source=listed.source or self._given.source or UNKNOWN,
            licence=listed.licence or licence_or_none(self._given.licence) or UNKNOWN,
            attribution=listed.attribution or self._given.attribution,
            name=listed.name or self._given.name,
            category=facts.category,
            grp=facts.group,
            size_m=facts.size_m,
            size_source=facts.size_source,
            size_band=size_band_of(facts.size_m),
            sha256=None,
            bytes=None,
            modified_ns=None,
            status="listed",
            cause=None,
        )

    def _put(self, batch: list[Row]) -> None:
        known = self._store.known(row.place for row in batch)
        changed = []
        for new in batch:
            before = known.get(new.place)
            told = new if before is None else _merge_row(new, before)
            row = told if told.kind == "url" else _read(told, before, self._root)
            if row.status == "unreadable":
                self._added.unreadable[row.cause or ""] = self._added.unreadable.get(row.cause or "", 0) + 1
            if before is None:
                self._added.new += 1
            elif before == row:
                self._added.unchanged += 1
                continue
            else:
                self._added.changed += 1
            changed.append(row)
        self._store.put(changed)


def _kind(place: str) -> Kind | None:
    suffix = os.path.splitext(place)[1].lower()
    if suffix in IMAGE_SUFFIXES:
        return "image"
    if suffix in MESH_SUFFIXES:
        return "mesh"
    return "asset" if os.path.isfile(os.path.join(place, IMPORTED_MESH)) else None


def _read(row: Row, before: Row | None, root: Path) -> Row:
    """Return the row with its file's digest, size and modification time, or with the cause why the file is unreadable.

    A file whose size and modification time match the catalogue is not read again.
    """
    path = Path(row.place, IMPORTED_MESH) if row.kind == "asset" else Path(row.place)
    try:
        with open_regular(path, EntryError, inside=root, name="file") as stream:
            found = os.fstat(stream.fileno())
            size, at = found.st_size, found.st_mtime_ns
            if size == 0:
                raise EntryError("is empty")
            if size > MAX_INPUT_BYTES:
                raise EntryError(f"is larger than {MAX_INPUT_BYTES >> 30} GiB")
            if before is not None and before.sha256 and (before.bytes, before.modified_ns) == (size, at):
                digest = before.sha256
            else:
                digest = _digest(stream)
    except (EntryError, OSError) as error:
        said = error.strerror or "cannot be read" if isinstance(error, OSError) else str(error).removeprefix("file: ")
        return replace(row, status="unreadable", cause=printable_line(said, max_characters=_CAUSE_CHARACTERS))
    return replace(row, status="ready", sha256=digest, bytes=size, modified_ns=at)


def _merge_row(row: Row, before: Row) -> Row:
    """Return the new row with its unknown values filled in from the previous row."""
    if row.licence == UNKNOWN:
        row = replace(row, licence=before.licence)
    if row.name is None:
        row = replace(row, name=before.name, category=before.category, grp=before.grp)
    if row.size_source != "given" and (row.size_m is None or before.size_source == "given"):
        row = replace(row, size_m=before.size_m, size_source=before.size_source, size_band=before.size_band)
    return replace(row, attribution=row.attribution or before.attribution)


def _digest(stream: BinaryIO) -> str:
    digest = hashlib.sha256()
    while part := stream.read(1 << 20):
        digest.update(part)
    return digest.hexdigest()


def _utf8(text: str) -> str | None:
    try:
        text.encode()
    except UnicodeEncodeError:
        return None
    return text
