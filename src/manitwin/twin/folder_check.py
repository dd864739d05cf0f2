"""Check of a twin folder from an untrusted source: only regular files, folders, and links that stay inside are allowed.

A file may be a link to another place, a device, or a pipe without a writer. The check is made before the record is read, so
that no later reader encounters one, whatever the record states.
"""

from __future__ import annotations

import os
from pathlib import Path

from manitwin.errors import TwinError
from manitwin.formats.printable import printable_line

_MOST_ENTRIES = 100_000


def require_regular_folder(folder: Path) -> None:
    """Raise TwinError if a twin's folder contains anything but regular files, folders, and links that stay inside."""
    left, entries = [folder], 0
    while left:
        place = left.pop()
        try:
            with os.scandir(place) as scanned:
                for entry in scanned:
                    entries += 1
                    if entry.is_symlink():
                        _require_inside(folder, Path(entry.path))
                    elif entry.is_dir(follow_symlinks=False):
                        left.append(Path(entry.path))
                    elif not entry.is_file(follow_symlinks=False):
                        raise TwinError(_refusal(entry.path, "is not a regular file"))
        except OSError as error:
            raise TwinError(f"{place}: cannot be read ({error.strerror or error}); check its permissions") from error
        if entries > _MOST_ENTRIES:
            raise TwinError(f"{folder}: contains more than {_MOST_ENTRIES} files; build the twin again")


def _require_inside(folder: Path, path: Path) -> None:
    try:
        target = path.resolve(strict=True)
    except (OSError, RuntimeError, ValueError) as error:  # broken or circular (RuntimeError until Python 3.12)
        raise TwinError(_refusal(path, "is a broken link")) from error
    if not target.is_relative_to(folder.resolve()):
        raise TwinError(_refusal(path, "leads outside the folder of the twin, and is not read"))
    if not target.is_file() and not target.is_dir():
        raise TwinError(_refusal(path, "is not a regular file"))


def _refusal(path: str | Path, what: str) -> str:
    return f"{printable_line(str(path))}: {what}; build or download the twin again"
