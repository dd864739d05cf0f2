"""Reader of untrusted HDF5: a regular file whose groups and numeric arrays are contained in it, up to a size limit.

An HDF5 file may refer to other files by external and soft links, external arrays and virtual data sets; request filters that
HDF5 loads as plugins; hold references and pickled objects; and declare an array of 2^50 numbers without data. None of this is
followed, loaded or allocated.

Source: the HDF5 1.14 reference, "Property Lists" and "Filters"; h5py's low-level API.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from manitwin.formats.bounded_file import Refusal, open_regular, with_remedy
from manitwin.formats.printable import printable_line

MAX_ARRAY_BYTES = 1 << 30
MAX_TEXT_BYTES = 16 << 20
MAX_OBJECTS = 100_000
_DEPTH = 16
_FILTERS = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32}
"""Filters built into every HDF5 library; others would be searched in HDF5_PLUGIN_PATH and loaded."""

_DEFLATE_RATIO = 1100
"""Upper bound of the expansion by Deflate, which is 1,032."""

_FAILURES = (OSError, RuntimeError, ValueError, KeyError, TypeError, MemoryError, OverflowError, AttributeError)
"""What h5py raises for invalid, truncated or altered files."""


class Hdf5:
    """An open file: arrays and texts by path, each checked before it is read."""

    def __init__(self, path: Path, refuse: Refusal, *, remedy: str, inside: Path | None = None):
        self._called, self._refuse, self._remedy = printable_line(str(path)), refuse, remedy
        open_regular(path, with_remedy(refuse, remedy), inside=inside, name=str(path)).close()
        with self._failures(""):
            self.file = h5py.File(path, "r")

    def close(self) -> None:
        """Close the file."""
        self.file.close()

    def names(self, group: str = "/") -> list[str]:
        """Return the names in a group."""
        with self._failures(group):
            found = self._object(group)
            if not isinstance(found, h5py.Group):
                raise self._wrong(group, "is not a group")
            if len(found) > MAX_OBJECTS:
                raise self._wrong(group, f"{len(found)} objects exceed the limit of {MAX_OBJECTS}")
            return list(found)

    def has(self, path: str) -> bool:
        """Return whether a path exists."""
        try:
            self._object(path)
        except KeyError:
            return False
        return True

    def text(self, path: str, attribute: str) -> bytes | None:
        """Return the bytes of a string attribute, None if it does not exist."""
        with self._failures(path):
            found = self._object(path)
            if attribute not in found.attrs:
                return None
            about = found.attrs.get_id(attribute)
            if about.dtype.kind != "S" or about.shape != () or about.dtype.itemsize > MAX_TEXT_BYTES:
                raise self._wrong(path, f"the attribute {attribute} is not a text of at most {MAX_TEXT_BYTES} bytes")
            return bytes(found.attrs[attribute])

    def array(self, path: str) -> np.ndarray:
        """Return an array of numbers."""
        with self._failures(path):
            content: np.ndarray = self._array(path)[()]
            return content

    def length(self, path: str) -> int:
        """Return the length of an array's first axis."""
        with self._failures(path):
            return int(self._array(path).shape[0])

    def size_bytes(self, path: str) -> int:
        """Return the memory size of all arrays in a group, checked like ``group``."""
        found = self.group(path)
        with self._failures(path):
            return _bytes_below(found)

    def group(self, path: str) -> h5py.Group:
        """Return a group after checking all of its content, so that it can be copied."""
        with self._failures(path):
            found = self._object(path)
            seen: set[int] = set()
            self._look_through(found, path, seen, 0)
            return found

    def _look_through(self, group: Any, path: str, seen: set[int], depth: int) -> None:
        if not isinstance(group, h5py.Group):
            raise self._wrong(path, "is not a group")
        if depth > _DEPTH:
            raise self._wrong(path, "its groups are nested too deep")
        for name in self.names(path):
            inner = f"{path}/{name}"
            found = self._object(inner)
            address = h5py.h5o.get_info(found.id).addr
            if address in seen or len(seen) > MAX_OBJECTS:
                raise self._wrong(inner, "occurs twice, or links back to a group that contains it")
            seen.add(address)
            for attribute in found.attrs:
                self.text(inner, attribute)
            if isinstance(found, h5py.Dataset):
                self._array(inner)
            else:
                self._look_through(found, inner, seen, depth + 1)

    def _object(self, path: str) -> Any:
        """Return an object that is reachable by hard links only."""
        found: Any = self.file
        for part in filter(None, path.split("/")):
            if not isinstance(found, h5py.Group):
                raise KeyError(path)
            link = found.get(part, getlink=True)
            if link is None:
                raise KeyError(path)
            if not isinstance(link, h5py.HardLink):
                raise self._wrong(path, "is a link, but only data within the file is read")
            found = found[part]
        return found

    def _array(self, path: str) -> h5py.Dataset:
        found = self._object(path)
        if not isinstance(found, h5py.Dataset):
            raise self._wrong(path, "is not an array")
        kind, shape, made = found.dtype, found.shape, found.id.get_create_plist()
        if kind.kind not in "biuf" or kind.hasobject or kind.subdtype is not None or shape is None:
            raise self._wrong(path, f"is of type {kind}, not of numbers")
        if made.get_layout() == h5py.h5d.VIRTUAL or made.get_external_count():
            raise self._wrong(path, "is stored in other files, but only data within this file is read")
        filters = {made.get_filter(number)[0] for number in range(made.get_nfilters())}
        if filters - _FILTERS:
            raise self._wrong(path, f"has the filter {min(filters - _FILTERS)}, but plugins are not loaded; use gzip")
        size, chunk = math.prod(shape) * kind.itemsize, math.prod(found.chunks or ()) * kind.itemsize
        if max(size, chunk) > MAX_ARRAY_BYTES:
            raise self._wrong(path, f"{max(size, chunk)} bytes exceed the limit of {MAX_ARRAY_BYTES}")
        if size > found.id.get_storage_size() * _DEFLATE_RATIO:
            raise self._wrong(path, f"declares {size} bytes, but {found.id.get_storage_size()} were written")
        return found

    def _wrong(self, path: str, cause: str) -> Exception:
        return self._refuse(f"{self._called}: {printable_line(path, max_characters=80)}: {cause}; {self._remedy}")

    @contextmanager
    def _failures(self, path: str) -> Iterator[None]:
        try:
            yield
        except _FAILURES as error:
            said = printable_line(" ".join(str(error).split()), max_characters=160)
            where = f"{printable_line(path, max_characters=80)}: " if path else ""
            raise self._refuse(
                f"{self._called}: {where}not a readable HDF5 file ({type(error).__name__}: {said}); {self._remedy}"
            ) from error


def _bytes_below(group: h5py.Group) -> int:
    return sum(each.nbytes if isinstance(each, h5py.Dataset) else _bytes_below(each) for each in group.values())
