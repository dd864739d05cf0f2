"""Integrity checks of a finished twin's folder: by file sizes, which is cheap, or by digests.

The sizes are in run.json (``bytes``), which is not part of the revision. For twins without them (of earlier versions, or
unpacked from a publication), files whose first or last bytes reveal their length are checked.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType

from manitwin.errors import TwinError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.json_file import read_json_object
from manitwin.formats.printable import printable_line
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import RECORD, REMEDY, RUN, canonical_json, write_bytes_atomically

BYTES = "bytes"
_MOST_NAMED = 3
_PNG_END = b"IEND\xaeB`\x82"


def write_sizes(folder: Path, changed: Mapping[str, int] = MappingProxyType({})) -> None:
    """Write the sizes of all files of a twin's folder to its run.json; ``changed`` gives the sizes of files about to be
    written.
    """
    run = read_json_object(folder / RUN, TwinError, inside=folder, name=str(folder / RUN), remedy=REMEDY)
    found = {name: size for name, size in DatasetRoot(folder).sizes_below("").items() if size is not None}
    sizes = {name: size for name, size in {**found, **changed}.items() if name != RUN}
    write_bytes_atomically(folder / RUN, canonical_json({**run, BYTES: sizes}).encode())


def read_sizes(root: DatasetRoot, folder: str) -> dict[str, int] | None:
    """Return the sizes in a twin's run.json, None if it has none. Raises TwinError if the file cannot be read."""
    try:
        said = root.read_json(f"{folder}/{RUN}", TwinError, remedy=REMEDY).get(BYTES)
    except FileNotFoundError as error:
        raise TwinError(f"{root.full(folder)}: lacks {RUN}; {REMEDY}") from error
    if said is None:
        return None
    if not isinstance(said, dict) or not all(type(size) is int and size >= 0 for size in said.values()):
        raise TwinError(f"{root.full(folder)}/{RUN}: {BYTES} are not file sizes; {REMEDY}")
    return dict(said)


def find_size_damage(root: DatasetRoot, folder: str) -> str | None:
    """Return what is wrong with a folder, from the sizes in its run.json alone; None if nothing is, or if it has no sizes."""
    try:
        sizes = read_sizes(root, folder)
    except TwinError as error:
        return str(error)
    if sizes is None:
        return None if root.exists(f"{folder}/{RECORD}") else f"its folder lacks {RECORD}"
    return _differences(root.sizes_below(folder), sizes)


def find_damage(root: DatasetRoot, folder: str, record: TwinRecord, *, digests: bool) -> str | None:
    """Return what is wrong with a twin's files, from their sizes and, with ``digests``, their contents; None if nothing is."""
    found = root.sizes_below(folder)
    try:
        sizes = read_sizes(root, folder)
    except TwinError as error:
        return str(error)
    missing = _abbreviate_names(record.files.keys() - found.keys())
    if missing:
        return f"its folder lacks {missing}"
    wrong = _differences(found, {} if sizes is None else sizes)
    if wrong is None and sizes is None:
        wrong = next(
            filter(None, (_truncation_message(root, f"{folder}/{name}", found[name]) for name in sorted(record.files))),
            None,
        )
    if wrong is None and digests:
        wrong = next(_changed_files(root, folder, record), None)
    return wrong


def find_foreign_files(root: DatasetRoot, folder: str, record: TwinRecord) -> str | None:
    """Return the files in a twin's folder that its record does not name; None if there are none."""
    return _abbreviate_names(root.sizes_below(folder).keys() - record.files.keys() - {RECORD, RUN})


def _differences(found: Mapping[str, int | None], sizes: Mapping[str, int]) -> str | None:
    missing = _abbreviate_names(sizes.keys() - found.keys())
    if missing:
        return f"its folder lacks {missing}"
    for name, size in sorted(sizes.items()):
        if found[name] is None:
            return f"{printable_line(name)} is not a regular file"
        if found[name] != size:
            return f"{printable_line(name)} has {found[name]} bytes, but {size} were written"
    return None


def _truncation_message(root: DatasetRoot, name: str, size: int | None) -> str | None:
    """Return a message if a file's first or last bytes show that it is truncated; files at a URL are not opened."""
    called = printable_line(name.rpartition("/")[2])
    if not size:
        return f"{called} is not a regular file" if size is None else f"{called} is empty"
    if root.local is None:
        return None
    path = Path(root.full(name))
    with open_regular(path, TwinError, inside=root.local, name=str(path)) as stream:
        head = stream.read(12)
        stream.seek(-min(size, 8), os.SEEK_END)
        tail = stream.read(8)
    whole = {
        ".parquet": head[:4] == tail[4:] == b"PAR1",
        ".glb": len(head) == 12 and struct.unpack("<I", head[8:])[0] == size,
        ".webp": len(head) == 12 and struct.unpack("<I", head[4:8])[0] + 8 == size,
        ".png": tail == _PNG_END,
        ".npy": head.startswith(b"\x93NUMPY"),
    }
    return None if whole.get(path.suffix, True) else f"{called} is truncated or not a {path.suffix[1:]} file"


def _changed_files(root: DatasetRoot, folder: str, record: TwinRecord) -> Iterator[str]:
    for name, digest in sorted(record.files.items()):
        try:
            content = root.read_bytes(f"{folder}/{name}")
        except TwinError as error:
            yield str(error)
            continue
        if sha256(content).hexdigest() != digest:
            yield f"{printable_line(name)} differs from what was written (its sha256 differs)"


def _abbreviate_names(names: set[str]) -> str | None:
    """Return the first few names, and how many more there are."""
    if not names:
        return None
    first = [printable_line(name, max_characters=80) for name in sorted(names)[:_MOST_NAMED]]
    return ", ".join(first) + (f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else "")
