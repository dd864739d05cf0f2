"""Allow-list of twin files that pages may read."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from manitwin.errors import TwinError, UsageError
from manitwin.formats.bounded_file import open_regular
from manitwin.twin.loaded_twin import Twin, TwinSource
from manitwin.twin.store import RECORD

MODEL, CARD = "visual.glb", "card.png"
INPUTS = {
    "source.png": "image/png",
    "source.jpg": "image/jpeg",
    "source.jpeg": "image/jpeg",
    "source.webp": "image/webp",
}
"""Input pictures that browsers can display, with their content types."""
NAMED = {CARD: "image/png", MODEL: "model/gltf-binary", RECORD: "application/json", **INPUTS}
VIEWS = re.compile(r"views/(rgb_[0-9]{2}|marked_[0-9]{2}|closer_f[0-9]+)\.webp")
MOST_BYTES = 256 << 20
"""Size limit of a file given to a browser, which keeps several copies in memory. A scan's GLB with textures has 100 MB."""
CHUNK_BYTES = 1 << 18
_TWIN_ID = re.compile(r"[0-9A-Za-z_][0-9A-Za-z_.-]{0,99}")


@dataclass(frozen=True)
class ServedFile:
    """An open file of a twin; ``chunks`` yields its bytes and closes it."""

    stream: BinaryIO
    size_bytes: int
    content_type: str

    def chunks(self) -> Iterator[bytes]:
        """Yield the bytes, at most as many as the file had when it was opened."""
        left = self.size_bytes
        with self.stream:
            while left and (part := self.stream.read(min(left, CHUNK_BYTES))):
                left -= len(part)
                yield part


UNLIKE_INDEX = "put it back, or write the index again (manitwin index)"
"""Remedy if an index names a missing twin."""


class TwinFolders:
    """The folders of the twins of a data set, or of one twin, by id.

    ``cache`` stores the twins of a data set at a URL; ``remedy`` ends the error message for a missing twin. Raises UsageError if
    the place does not exist.
    """

    def __init__(self, place: str, cache: Path | None = None, remedy: str = UNLIKE_INDEX):
        one = Path(place)
        self.only: Twin | None = Twin(one) if "://" not in place and (one / RECORD).is_file() else None
        self._source = None if self.only else TwinSource(place, cache, remedy)

    def folder(self, twin_id: str) -> Path:
        """Return a twin's folder; raises UsageError for an unknown id."""
        if not _TWIN_ID.fullmatch(twin_id):
            raise UsageError("there is no twin of this name")
        if self.only is not None:
            if twin_id != self.only.record.twin_id:
                raise UsageError(
                    f"there is no twin {twin_id} here; the one that is shown is {self.only.record.twin_id}"
                )
            return self.only.folder
        assert self._source is not None
        return self._source.folder(twin_id)

    def twin(self, twin_id: str) -> Twin:
        """Return a twin; raises UsageError for an unknown id, TwinError if it cannot be read."""
        return Twin(self.folder(twin_id))


def open_file(folder: Path, name: str) -> ServedFile:
    """Open an allowed file of a twin; raises UsageError for another name, TwinError if it is missing or too large."""
    kind = "image/webp" if VIEWS.fullmatch(name) else NAMED.get(name)
    if kind is None:
        raise UsageError("there is no file of this name")
    stream = open_regular(folder / name, TwinError, inside=folder, name=name)
    size = os.fstat(stream.fileno()).st_size
    if size > MOST_BYTES:
        stream.close()
        raise TwinError(f"{name}: {size:,} bytes, {MOST_BYTES:,} at most are given to a browser; open the file itself")
    return ServedFile(stream, size, kind)
