"""Privacy check of a publication: no published file may name local folders or home directories."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

from manitwin.errors import ManiTwinError, TwinError
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import RECORD

HOME_FOLDER = re.compile(rb"(?<![\w.\-])/(?:home|Users)/[^/\s\"]+/|\b[A-Za-z]:[\\/]+Users[\\/]")
"""A home directory on Linux, macOS or Windows. In a URL, a letter precedes the slash, so that URLs do not match."""

_TEXT = (".json", ".txt")


def local_paths(roots: Iterable[DatasetRoot]) -> tuple[bytes, ...]:
    """Return the paths of local folders as bytes to search for in files, with and without symbolic links resolved."""
    local = [root.local for root in roots if root.local is not None]
    found = {str(path) for folder in local for path in (folder.absolute(), folder.resolve())}
    return tuple(sorted(f"{place}/".encode() for place in found if len(Path(place).parts) > 2))


def check_source(record: TwinRecord) -> None:
    """Raise TwinError if a record's source is not a bare file name."""
    file = record.source.file
    if file != PurePosixPath(file).name or "\\" in file or file in ("", ".", ".."):
        raise TwinError(f"{record.twin_id}/{RECORD}: source.file is {file!r}, not a file name; build the twin again")


def check_part(twin_id: str, part: str, content: bytes, places: tuple[bytes, ...]) -> None:
    """Raise TwinError if a part of a twin names a local folder of the data set or, in text files, a home directory.

    The source is published byte for byte and is not searched for home directories.
    """
    of_people = part.endswith(_TEXT) and not part.startswith("source.")
    remedy = "remove it from the name, prompt or attribution of the input, and build the twin again"
    _refuse_folders(f"{twin_id}/{part}", content, places, TwinError, remedy, of_people=of_people)


def check_text(where: str, words: str, places: tuple[bytes, ...], error: type[ManiTwinError]) -> None:
    """Raise ``error`` if a text to be published names a local folder of the data set or a home directory."""
    remedy = "remove it from the name, the prompt or the attribution that it comes from"
    _refuse_folders(where, words.encode(), places, error, remedy, of_people=True)


def _refuse_folders(
    where: str, content: bytes, places: tuple[bytes, ...], error: type[ManiTwinError], remedy: str, *, of_people: bool
) -> None:
    found = next((place for place in places if place in content), None)
    if found is None and of_people and (match := HOME_FOLDER.search(content)):
        found = match.group()
    if found is not None:
        raise error(f"{where}: names the folder {found.decode(errors='replace')!r} of a machine; {remedy}")
