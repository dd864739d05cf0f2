"""Check of the places that ``collect add`` accepts, a folder or a list, by the arguments alone."""

from __future__ import annotations

from pathlib import Path

from manitwin.dataset.collect.listings import is_listing
from manitwin.errors import UsageError

LIST_SUFFIXES = frozenset({".csv", ".jsonl"})


def require_place(place: Path, source: str | None, root: Path | None) -> None:
    """Raise UsageError for a place that is neither folder nor list, a folder without a source, or a folder with a root."""
    if not place.is_dir():
        if place.suffix.lower() not in LIST_SUFFIXES and not is_listing(place):
            raise UsageError(
                f"{place}: is not a folder or a list; give a folder, a .csv or .jsonl file, or a listing (.json)"
            )
        return
    if root is not None:
        raise UsageError("--root: applies to a list, but this is a folder; leave it out")
    if not source:
        raise UsageError("--source: missing; give the source of the files in this folder, such as --source 'my photos'")
