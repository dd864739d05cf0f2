"""Copy of an input that a twin keeps: a single file unchanged, or an archive of all its files, copied in blocks."""

from __future__ import annotations

import hashlib
import os
import shutil
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

from manitwin.errors import InputError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.printable import printable_line
from manitwin.formats.source_files import side_files

MAX_KEPT_BYTES = 4 << 30
"""Larger inputs are only described: readers refuse them, and a sparse file would fill the disk."""
REFERENCE = "source.txt"
"""File that describes an input that is not kept."""
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest date of a ZIP entry: equal inputs give equal archives
_BLOCK_BYTES = 1 << 20


def pack_source(
    path: Path, folder: Path, beside: Iterable[Path] = (), *, keep: bool = True, mask: Path | None = None
) -> tuple[str, str]:
    """Write into a folder what a twin keeps of its input; return the file name and its sha256.

    A single file is kept unchanged; a mesh with side files, or with further files ``beside`` it, as an uncompressed, undated
    archive of all of them. For more than ``MAX_KEPT_BYTES``, a text lists names and sizes; without ``keep``, it also lists the
    digest of each file. The ``mask`` of a photo is stored beside it under ``mask_name``. Raises InputError ``unreadable`` for a
    file that does not exist or is not regular.
    """
    others = sorted({*side_files(path), *(other.resolve() for other in beside)})
    root = path.parent.resolve()
    files = {_name_in(root, file, path.name): file for file in (path.resolve(), *others)}
    if mask is not None and keep:
        with _opened(mask) as stream, (folder / mask_name(mask)).open("wb") as kept:
            shutil.copyfileobj(stream, kept, _BLOCK_BYTES)
    elif mask is not None:
        files[mask_name(mask)] = mask
    return _packed(files, folder, path if not others else None, keep)


def photo_names(paths: Sequence[Path]) -> list[str]:
    """Return the names of several photos of one object in their archive."""
    return [f"photo_{number:02d}{path.suffix.lower()}" for number, path in enumerate(paths)]


def mask_names(paths: Sequence[Path]) -> list[str]:
    """Return the names of the photos' masks in that archive."""
    return [f"mask_{number:02d}{path.suffix.lower()}" for number, path in enumerate(paths)]


def masks_beside(masks: Sequence[str]) -> dict[str, Path]:
    """Return the masks of photos by their archive names, mask_02 for photo_02; ``masks`` has '' for a photo without one."""
    return {f"mask_{number:02d}{Path(mask).suffix.lower()}": Path(mask) for number, mask in enumerate(masks) if mask}


def mask_name(mask: Path) -> str:
    """Return the name of a single photo's mask beside it."""
    return f"source_mask{mask.suffix.lower()}"


def pack_photos(
    paths: Sequence[Path], folder: Path, *, keep: bool = True, beside: Mapping[str, Path] | None = None
) -> tuple[str, str]:
    """Write photos of one object into a folder as ``source.zip``, numbered in order; return its name and sha256.

    ``beside`` are further files by archive name. For more than ``MAX_KEPT_BYTES``, or without ``keep``, a text describes them
    as for other inputs. Raises InputError ``unreadable`` for a file that does not exist.
    """
    files = dict(zip(photo_names(paths), paths, strict=True)) | dict(beside or {})
    return _packed(files, folder, None, keep)


def _packed(files: Mapping[str, Path], folder: Path, single: Path | None, keep: bool) -> tuple[str, str]:
    """Store files by name in an archive, or a single one unchanged."""
    sizes = {called: _size(file) for called, file in files.items()}
    if sum(sizes.values()) > MAX_KEPT_BYTES:
        name = REFERENCE
        lines = [f"{printable_line(called)}: {size} bytes, not kept\n" for called, size in sizes.items()]
        (folder / name).write_text("".join(lines), encoding="utf-8")
    elif not keep:
        name = REFERENCE
        lines = [
            f"{printable_line(called)}: {sizes[called]} bytes, sha256 {_sha256(file)}, not kept\n"
            for called, file in files.items()
        ]
        (folder / name).write_text("".join(lines), encoding="utf-8")
    elif single is not None:
        name = f"source{single.suffix.lower()}"
        with _opened(single) as stream, (folder / name).open("wb") as kept:
            shutil.copyfileobj(stream, kept, _BLOCK_BYTES)
    else:
        name = "source.zip"
        with zipfile.ZipFile(folder / name, "w", zipfile.ZIP_STORED) as archive:
            for called, file in files.items():
                _add(archive, file, called)
    with (folder / name).open("rb") as stream:
        return name, hashlib.file_digest(stream, "sha256").hexdigest()


def _add(archive: zipfile.ZipFile, file: Path, name: str) -> None:
    entry = zipfile.ZipInfo(name, _EPOCH)
    with _opened(file) as stream:
        entry.file_size = os.fstat(stream.fileno()).st_size  # above 2 GiB its header has another form
        with archive.open(entry, "w") as kept:
            shutil.copyfileobj(stream, kept, _BLOCK_BYTES)


_opened = partial(open_regular, refuse=partial(InputError, "unreadable"))


def _sha256(file: Path) -> str:
    digest = hashlib.sha256()
    with _opened(file) as stream:
        while block := stream.read(_BLOCK_BYTES):
            digest.update(block)
    return digest.hexdigest()


def _size(file: Path) -> int:
    with _opened(file) as stream:
        return os.fstat(stream.fileno()).st_size


def _name_in(root: Path, file: Path, name: str) -> str:
    """Return a file's path below the input's folder; for an input that is a link out of it, the name of the link."""
    return file.relative_to(root).as_posix() if file.is_relative_to(root) else name
