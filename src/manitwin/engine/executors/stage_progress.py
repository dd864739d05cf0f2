"""Progress notes of running stages: small files that workers write and the driver reads."""

from __future__ import annotations

import json
import logging
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from manitwin.engine.stage import StagePart, progress_listener

RUN = logging.getLogger("manitwin.run")
NOTE = ".part"
EVERY_S = 1.0

_failure_told = False


@contextmanager
def write_progress_notes(folder: Path, ticket: int) -> Iterator[None]:
    """Write the progress of the stage run within the ``with`` statement to a file named by its job's ticket."""
    with progress_listener(_ProgressWriter(folder / f"{ticket}{NOTE}")):
        try:
            yield
        finally:
            drop_note(folder, ticket)


def read_notes(folder: Path) -> dict[int, StagePart]:
    """Return the progress of each job by ticket; jobs that have just ended may be included."""
    found = {}
    for path in folder.glob(f"*{NOTE}"):
        with suppress(FileNotFoundError):  # its stage has ended meanwhile
            found[int(path.stem)] = StagePart(*json.loads(path.read_bytes()))
    return found


def drop_note(folder: Path, ticket: int) -> None:
    """Remove the progress file of an ended job."""
    (folder / f"{ticket}{NOTE}").unlink(missing_ok=True)


class _ProgressWriter:
    """Write the progress of a stage to a file, at most once a second."""

    def __init__(self, path: Path):
        self._path, self._at = path, -EVERY_S

    def __call__(self, part: StagePart) -> None:
        if time.monotonic() - self._at < EVERY_S:
            return
        self._at = time.monotonic()
        fresh = self._path.with_suffix(".fresh")
        try:  # renamed to be atomic, but not synced: progress is of no use after a power cut
            fresh.write_text(json.dumps([part.done, part.total, part.unit]))
            os.replace(fresh, self._path)
        except OSError as error:
            _log_failure_once(error)


def _log_failure_once(error: OSError) -> None:
    """Log once that progress could not be written; the stage continues."""
    global _failure_told
    if not _failure_told:
        _failure_told = True
        RUN.warning("the progress of stages is not shown: %s", error)
