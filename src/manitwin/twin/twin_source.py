"""Where a scene's twins are: a data set, or a flat folder of twins as ``manitwin build`` leaves."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from manitwin.errors import UsageError
from manitwin.twin.dataset_root import TWINS, DatasetRoot, twin_name
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import RECORD


class TwinSource:
    """Finds twins by id below a data set's root or a flat folder.

    Those of a data set at a URL are copied to ``cache`` when they are asked for. Raises UsageError where there is no such
    place, or for a URL without ``cache``.
    """

    def __init__(self, place: str | Path, cache: Path | None = None):
        self.root = DatasetRoot(place)
        self.cache = cache
        if self.root.local is None and cache is None:
            raise UsageError(
                f"{place}: a data set at a URL needs a local folder to copy its twins to; name one as cache"
            )
        if self.root.local is not None and not self.root.local.is_dir():
            raise UsageError(
                f"{place}: no such folder; give a data set, or the folder that `manitwin build` made (for the twins of"
                " scenes or episodes: --twins)"
            )
        self.flat = not self.root.exists(TWINS)

    def twin_ids(self) -> list[str]:
        """Return the ids of all finished twins, accepted and rejected, sorted."""
        if not self.flat:
            return list(self.root.twin_ids())
        return sorted(self._flat_ids())

    def record_bytes(self, twin_id: str) -> bytes:
        """Return the content of a twin's twin.json; raises UsageError where there is no such twin."""
        try:
            return self.root.read_bytes(f"{self._name(twin_id)}/{RECORD}")
        except FileNotFoundError as error:
            raise UsageError(self._missing(twin_id)) from error

    def check(self, twin_ids: Collection[str]) -> None:
        """Raise UsageError where twins are not there, with how many of them; only whether they are there is looked at."""
        gone = sorted(each for each in twin_ids if not self.root.exists(f"{self._name(each)}/{RECORD}"))
        if gone:
            raise UsageError(self._missing(gone[0], f" ({len(gone):,} of {len(twin_ids):,} are missing)"))

    def folder(self, twin_id: str) -> Path:
        """Return a local folder with a twin's files; raises UsageError where there is no such twin."""
        name = self._name(twin_id)
        if self.cache is None:
            folder = Path(self.root.full(name))
        else:
            folder = self.cache / twin_id
            if not (folder / RECORD).is_file():
                self.root.fetch_folder(name, folder)
        if not (folder / RECORD).is_file():
            raise UsageError(self._missing(twin_id))
        return folder

    def twin(self, twin_id: str) -> Twin:
        """Return the twin; raises UsageError where there is none of this id, TwinError where it cannot be read."""
        return Twin(self.folder(twin_id))

    def _name(self, twin_id: str) -> str:
        return twin_id if self.flat else twin_name(twin_id)

    def _missing(self, twin_id: str, count: str = "") -> str:
        return (
            f"{self.root.url}: no twin {twin_id} there{count}; put it back, or name the data set where the twins are now"
            " (--twins)"
        )

    def _flat_ids(self) -> Iterator[str]:
        assert self.root.local is not None
        for folder in self.root.local.iterdir():
            if (folder / RECORD).is_file() and not folder.name.startswith("."):
                yield folder.name
