"""The files of a twin as members of a shard, and back.

webdataset splits a member's name at the first dot: what is before it is the sample's key (the twin's id), what is after it
the name of the part. A part has no folder, so ``views/rgb_00.webp`` is ``rgb_00.webp``, and every other folder is one
archive: ``collision/hull_00.obj ...`` are ``collision.zip``. It is stored uncompressed: the same bytes with any zlib, no
archive that unfolds into more than it weighs, and the files keep the bytes that twin.json has the digests of.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import PurePosixPath

from manitwin.errors import TwinError

VIEWS = "views"
KEY = re.compile(r"[0-9A-Za-z_-]+")
"""What can be the key of a sample and the name of a folder."""

_FILE = re.compile(r"[0-9A-Za-z_-][0-9A-Za-z_.-]*(?:/[0-9A-Za-z_-][0-9A-Za-z_.-]*)*")
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest date of a ZIP entry


def parts_of(files: Iterable[str]) -> dict[str, list[str]]:
    """Return ``{part: names of its files}``, sorted, of a twin's files.

    Raises TwinError for a name that leaves the folder or that two parts would share.
    """
    parts: dict[str, list[str]] = {}
    single: set[str] = set()
    for file in sorted(files):
        if not _FILE.fullmatch(file):
            raise TwinError(f"{file!r}: no name for a file of a twin; give letters, digits and . _ - in relative names")
        path = PurePosixPath(file)
        alone = len(path.parts) == 1 or (len(path.parts) == 2 and path.parts[0] == VIEWS)
        part = path.name if alone else f"{path.parts[0]}.zip"
        part = part.lower()  # as webdataset reads it
        if part in single or (alone and part in parts):
            raise TwinError(f"{file}: another file of the twin has the part {part!r} already; rename one of them")
        if alone:
            single.add(part)
        parts.setdefault(part, []).append(file)
    return dict(sorted(parts.items()))


def is_archive(files: list[str]) -> bool:
    """Tell whether the files of a part are kept in an archive."""
    parts = PurePosixPath(files[0]).parts
    return len(parts) > 2 or (len(parts) == 2 and parts[0] != VIEWS)


def pack(files: list[str], contents: Mapping[str, bytes]) -> bytes:
    """Return a part's bytes: the file's own, or an uncompressed, undated archive of the folder's files."""
    if not is_archive(files):
        return contents[files[0]]
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        for file in files:
            entry = zipfile.ZipInfo(file.partition("/")[2], _EPOCH)
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, contents[file])
    return stream.getvalue()


def unpack(files: list[str], content: bytes) -> dict[str, bytes]:
    """Return the files of a part; raises TwinError for an archive that holds anything else or is compressed."""
    if not is_archive(files):
        return {files[0]: content}
    folder = files[0].partition("/")[0]
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = archive.infolist()
            if any(entry.compress_type != zipfile.ZIP_STORED for entry in entries):
                raise TwinError(f"{folder}.zip: compressed, as no shard of manitwin has it; download the shard again")
            if sorted(f"{folder}/{entry.filename}" for entry in entries) != files:
                raise TwinError(f"{folder}.zip: not the files that twin.json names; download the shard again")
            return {f"{folder}/{entry.filename}": archive.read(entry) for entry in entries}
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError) as error:
        raise TwinError(f"{folder}.zip: cannot be read ({error}); download the shard again") from error
