"""Check that nothing published names folders of this machine, or the people in them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

from manitwin.errors import ManiTwinError, TwinError
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import RECORD

HOME_FOLDER = re.compile(rb"(?<![\w.\-])/(?:home|Users)/[^/\s\"]+/|\b[A-Za-z]:[\\/]+Users[\\/]")
"""A folder of a person on Linux, macOS or Windows; in a web address a letter stands before the slash."""

_TEXT = (".json", ".txt")


def places_of(roots: Iterable[DatasetRoot]) -> tuple[bytes, ...]:
    """Return the paths of local folders as they would be found in a file, with and without links resolved."""
    local = [root.local for root in roots if root.local is not None]
    found = {str(path) for folder in local for path in (folder.absolute(), folder.resolve())}
    return tuple(sorted(f"{place}/".encode() for place in found if len(Path(place).parts) > 2))


def check_source(record: TwinRecord) -> None:
    """Raise TwinError where a record's source is not a name alone."""
    file = record.source.file
    if file != PurePosixPath(file).name or "\\" in file or file in ("", ".", ".."):
        raise TwinError(f"{record.twin_id}/{RECORD}: source.file is {file!r}, not a file name; build the twin again")


def check_part(twin_id: str, part: str, content: bytes, places: tuple[bytes, ...]) -> None:
    """Raise TwinError where a part of a twin names a local folder of the data set, or as text a person's folder.

    The source is its author's, byte for byte, and is not searched for people's folders.
    """
    of_people = part.endswith(_TEXT) and not part.startswith("source.")
    remedy = "remove it from the name, prompt or attribution of the input, and build the twin again"
    _refuse_folders(f"{twin_id}/{part}", content, places, TwinError, remedy, of_people=of_people)


def check_words(where: str, words: str, places: tuple[bytes, ...], error: type[ManiTwinError]) -> None:
    """Raise ``error`` where words that are to go out name a local folder of what is published, or a person's folder."""
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
