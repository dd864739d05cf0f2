"""Lazily loaded sequence of a data set's twins."""

from __future__ import annotations

import operator
import shutil
import tempfile
import weakref
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, SupportsIndex, overload

from manitwin.twin.dataset_root import DatasetRoot

if TYPE_CHECKING:
    from manitwin.twin.loaded_twin import Twin

_SHOWN = 3


class Twins(Sequence["Twin"]):
    """Twins by position, loaded on access; a slice is another such sequence and reads no folder.

    A twin is loaded anew on every access. From a URL, its folder is a temporary copy that is removed with the twin object.
    ``in``, ``index`` and ``count`` take a twin or its id and load nothing. Raises IndexError for positions out of range, KeyError
    for an id that is not in the sequence, and TwinError for a folder that cannot be read.
    """

    def __init__(self, root: DatasetRoot, ids: Sequence[str]):
        self._root, self._ids = root, ids

    def ids(self) -> list[str]:
        """Return the twin ids in sequence order."""
        return list(self._ids)

    def __repr__(self) -> str:
        shown = ", ".join(self._ids[:_SHOWN]) + (", ..." if len(self._ids) > _SHOWN else "")
        return f"Twins({self._root.url!r}, {len(self._ids)}: {shown})"

    def __len__(self) -> int:
        return len(self._ids)

    @overload
    def __getitem__(self, place: SupportsIndex | str) -> Twin: ...
    @overload
    def __getitem__(self, place: slice) -> Twins: ...
    def __getitem__(self, place: SupportsIndex | str | slice) -> Twin | Twins:
        if isinstance(place, slice):
            return Twins(self._root, self._ids[place])
        if isinstance(place, str):
            if place not in self._ids:
                raise KeyError(f"no twin {place} among these {len(self._ids)}")
            return load_twin(self._root, place)
        try:
            twin_id = self._ids[operator.index(place)]
        except IndexError:
            count = len(self._ids)
            valid = f"give {-count} to {count - 1}" if count else "there are none"
            raise IndexError(f"no twin {place} of {count}; {valid}") from None
        return load_twin(self._root, twin_id)

    def __iter__(self) -> Iterator[Twin]:
        return (load_twin(self._root, twin_id) for twin_id in self._ids)

    def __reversed__(self) -> Iterator[Twin]:
        return iter(self[::-1])

    def __contains__(self, twin: object) -> bool:
        return id_of(twin) in self._ids

    def index(self, twin: Any, start: int = 0, stop: int | None = None) -> int:
        """Return the first position of a twin, given as a loaded twin or an id; raises ValueError if it is not present."""
        return self._ids.index(id_of(twin), *slice(start, stop).indices(len(self._ids))[:2])

    def count(self, twin: Any) -> int:
        """Return how often a twin, given as a loaded twin or an id, occurs."""
        return self._ids.count(id_of(twin))


def id_of(twin: Any) -> str | None:
    """Return the id of a twin that is given as a loaded twin or an id; None for anything else."""
    return twin if isinstance(twin, str) else getattr(getattr(twin, "record", None), "twin_id", None)


def load_twin(root: DatasetRoot, twin_id: str) -> Twin:
    """Load a twin of a data set; from a URL, load a copy that is removed with the twin object. Raises TwinError."""
    from manitwin.twin.loaded_twin import Twin

    if root.local is not None:
        return Twin(root.local / root.twin_name(twin_id))
    copy = Path(tempfile.mkdtemp(prefix="manitwin-")) / twin_id
    try:
        root.fetch_folder(root.twin_name(twin_id), copy)
        twin = Twin(copy)
    except BaseException:
        shutil.rmtree(copy.parent, ignore_errors=True)
        raise
    weakref.finalize(twin, shutil.rmtree, copy.parent, ignore_errors=True)
    return twin


@contextmanager
def local_files(root: DatasetRoot, twin_id: str, files: Iterable[str]) -> Iterator[Path]:
    """Provide a local folder with the existing ones of a twin's files: its own folder or, for a URL, a temporary copy."""
    name = root.twin_name(twin_id)
    if root.local is not None:
        yield root.local / name
        return
    with tempfile.TemporaryDirectory(prefix="manitwin-") as scratch:
        folder = Path(scratch) / twin_id
        folder.mkdir()
        for file in files:
            if root.exists(f"{name}/{file}"):  # the reader of the folder reports missing files
                root.fetch_file(f"{name}/{file}", folder / file)
        yield folder
