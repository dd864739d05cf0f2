"""The root of a data set: a local folder, or any URL that fsspec can read and write (``s3://``, ``gs://``, ``memory://``).

Layout::

  DATASET/
    config.json                 the complete configuration of the build
    ledger.sqlite               the run's ledger (for a URL a copy; the ledger itself is local)
    twins/<2 hex>/<twin_id>/    finished twins, accepted and rejected
    index/                      Parquet tables
    reviews.sqlite              reviewers' judgements of twins
    reviews.access.json         reviewers who were let in: digests of links and cookies
    amendments/<2 hex>/<twin_id>.json   manual corrections
    .work/<twin_id>/<stage>/<key>/   results of stages
"""

from __future__ import annotations

import errno
import os
import re
import shutil
import stat
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any

from fsspec.core import url_to_fs
from fsspec.implementations.local import LocalFileSystem

from manitwin.errors import TwinError, UsageError
from manitwin.formats.bounded_file import Refusal, read_bytes
from manitwin.formats.json_file import MAX_JSON_BYTES, MEND, parse_json_object
from manitwin.twin.store import RECORD, atomic_file, replace_folder, write_bytes_atomically

TWINS = "twins"
_PASSWORD = re.compile(r"://[^/@\s]*:[^/@\s]*@")
MAX_FILE_BYTES = 2 << 30
"""Size limit of one file; the file of a scan with millions of triangles and textures has some hundred million bytes."""


def twin_name(twin_id: str) -> str:
    """Return a twin's folder relative to the root; 256 prefixes keep the number of entries per folder small."""
    return f"{TWINS}/{twin_id[:2]}/{twin_id}"


class DatasetRoot:
    """File access below one folder or URL; names are relative and use ``/``.

    Raises UsageError for a URL whose protocol is unknown or not installed, or that contains a password.
    """

    def __init__(self, url: str | Path):
        if _PASSWORD.search(str(url)):  # before anything else, because later messages and files contain the URL
            raise UsageError("the URL of a data set contains a password or a key; pass these in the environment only")
        try:
            self.fs, self.path = url_to_fs(str(url), use_listings_cache=False)  # other processes write there as well
        except (ValueError, ImportError) as error:
            raise UsageError(f"{url}: {error}; give a folder, or a URL such as s3://bucket/name") from error
        self.url = str(url)
        self.local: Path | None = Path(self.path) if isinstance(self.fs, LocalFileSystem) else None

    @cached_property
    def flat(self) -> bool:
        """True for the layout of earlier versions, with twin folders directly below the root; it is read but no longer
        written.
        """
        return self.local is not None and not self.exists(TWINS) and any(self._flat_ids())

    @property
    def has_twins(self) -> bool:
        """True if the data set holds twins, in the current layout or that of earlier versions."""
        return self.exists(TWINS) or self.flat

    def _flat_ids(self) -> Iterator[str]:
        assert self.local is not None
        for record in self.local.glob(f"[!.]*/{RECORD}") if self.local.is_dir() else ():
            yield record.parent.name

    def twin_name(self, twin_id: str) -> str:
        """Return a twin's folder relative to the root, in the data set's layout."""
        return twin_id if self.flat else twin_name(twin_id)

    def __reduce__(self) -> tuple[type, tuple[str]]:
        return type(self), (self.path if self.local else self.url,)

    def absolute(self) -> str:
        """Return the absolute path, for workers with another working directory; a URL is returned unchanged."""
        return self.url if self.local is None else str(self.local.resolve())

    def full(self, name: str) -> str:
        """Return the full path or URL of a name. Raises UsageError if the name leads out of the root."""
        if name.startswith("/") or ".." in PurePosixPath(name).parts:
            raise UsageError(f"{name}: lies outside the data set {self.url}; give a path below it")
        return f"{self.path.rstrip('/')}/{name}"

    def exists(self, name: str) -> bool:
        """Return whether a file or folder exists."""
        return bool(self.fs.exists(self.full(name)))

    def read_bytes(self, name: str, refuse: Refusal = TwinError, *, limit_bytes: int = MAX_FILE_BYTES) -> bytes:
        """Return a file's content. Raises FileNotFoundError.

        On a local root, a file that is not a regular file below the root, or is larger than ``limit_bytes``, raises the
        exception that ``refuse`` returns for a message.
        """
        full = self.full(name)
        if self.local is None:
            content: bytes = self.fs.cat_file(full)
            return content
        if not os.path.lexists(full):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), full)
        return read_bytes(Path(full), limit_bytes, refuse, inside=self.local, name=full)

    def read_json(self, name: str, refuse: Refusal = TwinError, *, remedy: str = MEND) -> dict[str, Any]:
        """Return the object in a JSON file. Raises FileNotFoundError, or the exception that ``refuse`` returns for a malformed
        file.
        """
        content = self.read_bytes(name, refuse, limit_bytes=MAX_JSON_BYTES)
        return parse_json_object(content, self.full(name), refuse, remedy=remedy)

    def write_bytes(self, name: str, content: bytes) -> None:
        """Write a file atomically."""
        if self.local is not None:
            place = Path(self.full(name))
            place.parent.mkdir(parents=True, exist_ok=True)
            write_bytes_atomically(place, content)
        else:
            self.fs.pipe_file(self.full(name), content)  # object stores make an object visible when it is complete

    def put_file(self, source: Path, name: str) -> None:
        """Copy a local file to ``name`` atomically."""
        if self.local is not None:
            place = Path(self.full(name))
            place.parent.mkdir(parents=True, exist_ok=True)
            with atomic_file(place) as beside:
                shutil.copyfile(source, beside)
        else:
            self.fs.put_file(str(source), self.full(name))

    def fetch_file(self, name: str, to: Path) -> None:
        """Copy a file to a local path. Raises FileNotFoundError."""
        to.parent.mkdir(parents=True, exist_ok=True)
        self.fs.get_file(self.full(name), str(to))

    def remove(self, name: str) -> None:
        """Remove a file or folder if it exists. Of a symbolic link only the link is removed."""
        if self.local is not None and _is_special(self.full(name)):
            os.unlink(self.full(name))
        elif self.fs.exists(self.full(name)):
            self.fs.rm(self.full(name), recursive=True)

    def names_below(self, name: str) -> list[str]:
        """Return the names of all files below a folder, sorted; empty if it does not exist."""
        root = self.path.rstrip("/") + "/"
        found = self.fs.find(self.full(name)) if self.fs.exists(self.full(name)) else []
        return sorted(str(path).removeprefix(root) for path in found)

    def sizes_below(self, name: str) -> dict[str, int | None]:
        """Return the size of each file below a folder by its name relative to it; None for links and special files."""
        full = self.full(name).rstrip("/")
        if self.local is None:
            found = self.fs.find(full, detail=True) if self.fs.exists(full) else {}
            return {str(path).removeprefix(f"{full}/"): int(about["size"]) for path, about in found.items()}
        sizes: dict[str, int | None] = {}
        for folder, folders, files in os.walk(full):
            links = [each for each in folders if os.path.islink(os.path.join(folder, each))]
            for each in (*files, *links):
                path = os.path.join(folder, each)
                about = os.lstat(path)
                sizes[os.path.relpath(path, full)] = about.st_size if stat.S_ISREG(about.st_mode) else None
        return sizes

    def put_folder(self, fresh: Path, name: str, record: str = RECORD) -> None:
        """Move a finished local folder to ``name``: its ``record`` is written last, then surplus files of the older folder are
        removed.

        On a local root the folder is renamed, so that ``fresh`` must be on the same file system.
        """
        if self.local is not None:
            replace_folder(fresh, Path(self.full(name)))
            return
        files = sorted((p for p in fresh.rglob("*") if p.is_file()), key=lambda p: (p.name == record, p))
        names = [f"{name}/{path.relative_to(fresh).as_posix()}" for path in files]
        before = self.names_below(name)
        for path, target in zip(files, names, strict=True):
            self.fs.put_file(str(path), self.full(target))
        for old in set(before) - set(names):
            self.fs.rm_file(self.full(old))
        shutil.rmtree(fresh)

    def fetch_folder(self, name: str, to: Path) -> Path:
        """Return a local folder with the files of a folder: the folder itself if the root is local, else a copy at ``to``."""
        if self.local is not None:
            return Path(self.full(name))
        for each in self.names_below(name):
            self.fetch_file(each, to / each.removeprefix(f"{name}/"))
        return to

    def twin_ids(self) -> Iterator[str]:
        """Yield the ids of all finished twins, sorted."""
        if self.flat:
            yield from sorted(self._flat_ids())
            return
        prefixes = sorted(self._children(TWINS))
        for prefix in prefixes:
            for twin_id in sorted(self._children(f"{TWINS}/{prefix}")):
                if self.exists(f"{TWINS}/{prefix}/{twin_id}/{RECORD}"):
                    yield twin_id

    def _children(self, name: str) -> list[str]:
        if not self.exists(name):
            return []
        return [PurePosixPath(path).name for path in self.fs.ls(self.full(name), detail=False)]


def _is_special(path: str) -> bool:
    """Return whether a path exists and is neither a regular file nor a folder (a link to anything, a pipe, a device)."""
    try:
        mode = os.lstat(path).st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))
