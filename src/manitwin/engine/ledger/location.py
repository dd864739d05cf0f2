"""Locations of a data set's ledger and log: inside the data set, or on this machine with a copy at the data set's URL."""

from __future__ import annotations

import hashlib
import os
import sqlite3
import tempfile
import time
from contextlib import closing
from pathlib import Path

from manitwin.engine.ledger.ledger import LEDGER
from manitwin.engine.ledger.reading import read_ledger
from manitwin.errors import UsageError
from manitwin.formats.user_folders import cache_home
from manitwin.twin.dataset_root import DatasetRoot

CONFIG = "config.json"
RUN_LOG = "run.log"
COPY_EVERY_S = 60.0


def ledger_path(root: DatasetRoot) -> Path:
    """Return the local path of the ledger: in the data set, or for a URL in the user's state folder."""
    if root.local is not None:
        return root.local / LEDGER
    state = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local/state") / "manitwin"
    return state / f"{_digest(root.url)}.sqlite"


def local_ledger(root: DatasetRoot) -> Path:
    """Return the local path of the ledger; for a URL, download the copy if this machine has no ledger."""
    path = ledger_path(root)
    if root.local is None and not path.is_file() and root.exists(LEDGER):
        root.fetch_file(LEDGER, path)
    return path


def copy_ledger(root: DatasetRoot, copy: Path) -> None:
    """Copy the ledger that a run would use, even while a run writes it; does nothing if there is no ledger."""
    path = ledger_path(root)
    if os.path.lexists(path):
        with read_ledger(path) as source, closing(sqlite3.connect(copy)) as target:
            source.backup(target)
    elif root.local is None and root.exists(LEDGER):
        root.fetch_file(LEDGER, copy)


def local_log(root: DatasetRoot) -> Path:
    """Return the path of the run log, which lies beside the ledger. Raises UsageError if it is a link or not a regular file."""
    ledger = local_ledger(root)
    log = ledger.with_name(RUN_LOG) if root.local is not None else ledger.with_suffix(".log")
    if log.is_symlink() or (log.exists() and not log.is_file()):
        raise UsageError(f"{log}: is a link or not a regular file, but runs write their log to it; remove it")
    return log


def cache_folder(root: DatasetRoot) -> Path:
    """Return the folder for local copies of a data set at a URL; a local data set is used in place."""
    if root.local is not None:
        return root.local
    return cache_home() / _digest(root.url)


def _digest(url: str) -> str:
    return hashlib.sha256(url.encode()).hexdigest()[:16]


class LedgerCopy:
    """The copy of a ledger at a data set's URL, in case the driver's machine is lost; does nothing for a local data set."""

    def __init__(self, root: DatasetRoot, path: Path):
        self._root, self._path, self._at = root, path, time.monotonic()

    def refresh(self) -> None:
        """Upload the ledger if the last copy is more than a minute old."""
        if time.monotonic() - self._at > COPY_EVERY_S:
            self.upload()

    def upload(self) -> None:
        """Upload the ledger."""
        if self._root.local is not None:
            return
        with tempfile.NamedTemporaryFile(suffix=".sqlite") as copy:
            with closing(sqlite3.connect(self._path)) as source, closing(sqlite3.connect(copy.name)) as target:
                source.backup(target)
            self._root.put_file(Path(copy.name), LEDGER)
        self._at = time.monotonic()
