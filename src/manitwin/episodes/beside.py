"""Files and folders that are written beside their place and renamed, so that nobody ever reads half of one."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from manitwin.twin.store import replace_folder


@contextmanager
def file_beside(place: Path) -> Iterator[Path]:
    """Give a path in the same folder; what is written there takes its place when the block ends well, else it is removed."""
    place.parent.mkdir(parents=True, exist_ok=True)
    beside = place.with_name(f".{place.name}.{os.getpid()}")
    try:
        yield beside
        with beside.open("rb") as stream:
            os.fsync(stream.fileno())
        os.replace(beside, place)
    finally:
        beside.unlink(missing_ok=True)


@contextmanager
def folder_beside(place: Path) -> Iterator[Path]:
    """Give an empty folder beside a place; it takes that place when the block ends well, else it is removed."""
    place.parent.mkdir(parents=True, exist_ok=True)
    beside = place.with_name(f".{place.name}.{os.getpid()}")
    shutil.rmtree(beside, ignore_errors=True)
    beside.mkdir()
    try:
        yield beside
        replace_folder(beside, place)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
