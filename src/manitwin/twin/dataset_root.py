"""The root of a data set: a local folder, or any URL that fsspec reads and writes (``s3://``, ``gs://``, ``memory://``).

DATASET/
  config.json                 what was asked for: the whole configuration
  ledger.sqlite               the run's ledger (of a URL: a copy, the ledger itself is local)
  twins/<2 hex>/<twin_id>/    finished twins, accepted and rejected
  index/                      Parquet tables
  reviews.sqlite              what people have said of twins
  reviews.access.json         who of them was let in before: digests of links and cookies
  amendments/<2 hex>/<twin_id>.json   what they have put right
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
from manitwin.twin.store import RECORD, file_beside, replace_folder, write_bytes_atomically

TWINS = "twins"
_PASSWORD = re.compile(r"://[^/@\s]*:[^/@\s]*@")
MAX_FILE_BYTES = 2 << 30
"""Of one file of a data set: that of a scan of millions of triangles with its pictures has some hundred million."""


def twin_name(twin_id: str) -> str:
    """Return a twin's folder below the root: 256 prefixes, so that no folder has more than some hundred entries."""
    return f"{TWINS}/{twin_id[:2]}/{twin_id}"


class DatasetRoot:
    """Read and write below one folder or URL; names are relative and use ``/``.

    Raises UsageError for a URL whose protocol is unknown or not installed, or that holds a password.
    """

    def __init__(self, url: str | Path):
        if _PASSWORD.search(str(url)):  # first of all: what comes after shows the URL, and writes it
            raise UsageError("the URL of a data set contains a password or a key; pass these in the environment only")
        try:
            self.fs, self.path = url_to_fs(str(url), use_listings_cache=False)  # others write there as well
        except (ValueError, ImportError) as error:
            raise UsageError(f"{url}: {error}; give a folder, or a URL such as s3://bucket/name") from error
        self.url = str(url)
        self.local: Path | None = Path(self.path) if isinstance(self.fs, LocalFileSystem) else None

    @cached_property
    def flat(self) -> bool:
        """True for the layout of earlier versions: twin folders directly below it. It is read, and no longer written."""
        return self.local is not None and not self.exists(TWINS) and any(self._flat_ids())

    @property
    def has_twins(self) -> bool:
        """True where it holds twins, or will: in the layout of today or of earlier versions."""
        return self.exists(TWINS) or self.flat

    def _flat_ids(self) -> Iterator[str]:
        assert self.local is not None
        for record in self.local.glob(f"[!.]*/{RECORD}") if self.local.is_dir() else ():
            yield record.parent.name

    def twin_name(self, twin_id: str) -> str:
        """Return the name of a twin's folder."""
        return twin_id if self.flat else twin_name(twin_id)

    def __reduce__(self) -> tuple[type, tuple[str]]:
        return type(self), (self.path if self.local else self.url,)

    def absolute(self) -> str:
        """Return a folder's absolute path, for workers that run elsewhere; a URL stays as it is."""
        return self.url if self.local is None else str(self.local.resolve())

    def full(self, name: str) -> str:
        """Return the name as the file system knows it. Raises UsageError for one that leaves the root."""
        if name.startswith("/") or ".." in PurePosixPath(name).parts:
            raise UsageError(f"{name}: lies outside the data set {self.url}; give a path below it")
        return f"{self.path.rstrip('/')}/{name}"

    def exists(self, name: str) -> bool:
        """Tell whether a file or folder is there."""
        return bool(self.fs.exists(self.full(name)))

    def read_bytes(self, name: str, refuse: Refusal = TwinError, *, limit_bytes: int = MAX_FILE_BYTES) -> bytes:
        """Return a file's content; raises FileNotFoundError.

        On a local root, what is no regular file below it, or larger than the limit, raises what ``refuse`` makes of one line.
        """
        full = self.full(name)
        if self.local is None:
            content: bytes = self.fs.cat_file(full)
            return content
        if not os.path.lexists(full):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), full)
        return read_bytes(Path(full), limit_bytes, refuse, inside=self.local, name=full)

    def read_json(self, name: str, refuse: Refusal = TwinError, *, remedy: str = MEND) -> dict[str, Any]:
        """Return the object that a JSON file holds; raises FileNotFoundError, and what ``refuse`` makes of one line."""
        content = self.read_bytes(name, refuse, limit_bytes=MAX_JSON_BYTES)
        return parse_json_object(content, self.full(name), refuse, remedy=remedy)

    def write_bytes(self, name: str, content: bytes) -> None:
        """Write a file whole or not at all."""
        if self.local is not None:
            place = Path(self.full(name))
            place.parent.mkdir(parents=True, exist_ok=True)
            write_bytes_atomically(place, content)
        else:
            self.fs.pipe_file(self.full(name), content)  # an object appears when it is complete

    def put_file(self, source: Path, name: str) -> None:
        """Copy a local file to a name, whole or not at all."""
        if self.local is not None:
            place = Path(self.full(name))
            place.parent.mkdir(parents=True, exist_ok=True)
            with file_beside(place) as beside:
                shutil.copyfile(source, beside)
        else:
            self.fs.put_file(str(source), self.full(name))

    def fetch_file(self, name: str, to: Path) -> None:
        """Copy a file to a local path; raises FileNotFoundError."""
        to.parent.mkdir(parents=True, exist_ok=True)
        self.fs.get_file(self.full(name), str(to))

    def remove(self, name: str) -> None:
        """Remove a file or a whole folder; one that is not there is no error. Of a link only the link itself goes."""
        if self.local is not None and _is_special(self.full(name)):
            os.unlink(self.full(name))
        elif self.fs.exists(self.full(name)):
            self.fs.rm(self.full(name), recursive=True)

    def names_below(self, name: str) -> list[str]:
        """Return the names of all files below a folder, sorted; empty where there is none."""
        root = self.path.rstrip("/") + "/"
        found = self.fs.find(self.full(name)) if self.fs.exists(self.full(name)) else []
        return sorted(str(path).removeprefix(root) for path in found)

    def sizes_below(self, name: str) -> dict[str, int | None]:
        """Return the sizes of all files below a folder by their names in it; None for links and what is no regular file."""
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
        """Move a finished local folder to its name; its ``record`` goes last, and what the older one had more goes then.

        On a local root ``fresh`` must be on the same file system, and is renamed.
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
        """Return a local folder with a folder's files: itself where the root is local, else a copy at ``to``."""
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
    """Tell whether a path is there and neither a file nor a folder: a link, whatever it leads to, a pipe, a device."""
    try:
        mode = os.lstat(path).st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))
