"""Output folders: an early check that they can be made and written, and atomic writing."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from manitwin.errors import UsageError


def require_writable_folder(folder: Path, what: str = "") -> None:
    """Raise UsageError if a path is no folder, or cannot be made or written; the folder is not made.

    ``what`` names what is to be written, for the message. An existing folder is left unchanged, including its times.
    """
    remedy = f"give a folder to write{f' {what}' if what else ''} into"
    try:
        for place in (folder, *folder.absolute().parents):
            if place.is_dir():
                _require_names(folder, place)
                _require_writable(place, made=place != folder)
                return
            if os.path.lexists(place) and not place.is_symlink():
                raise UsageError(f"{folder}: {_named(place, folder)}a file; {remedy}")
            if place.is_symlink():
                raise UsageError(f"{folder}: {_named(place, folder)}a link that leads nowhere; {remedy}")
    except OSError as error:
        raise UsageError(f"{folder}: cannot be written ({error.strerror or error}); {remedy}") from error
    except ValueError as error:  # a NUL in the path
        raise UsageError(f"{folder}: no path ({error}); {remedy}") from error


def require_new_folder(out: Path) -> None:
    """Raise UsageError if a folder exists and is not empty."""
    if out.exists() and any(out.iterdir()):
        raise UsageError(f"{out}: is there and not empty; give a new folder")


@contextmanager
def new_folder(out: Path) -> Iterator[Path]:
    """Yield a folder to write into, which is renamed to ``out`` at the end, or removed after a failure.

    Raises UsageError if ``out`` exists and is not empty.
    """
    require_new_folder(out)
    out.parent.mkdir(parents=True, exist_ok=True)
    fresh = Path(tempfile.mkdtemp(prefix=".manitwin-", dir=out.parent))
    try:
        fresh.chmod(0o755)
        yield fresh
        if out.exists():
            out.rmdir()
        os.rename(fresh, out)
    except BaseException:
        shutil.rmtree(fresh, ignore_errors=True)
        raise


def _require_names(folder: Path, there: Path) -> None:
    """Raise OSError if a name to be made is longer than the file system allows."""
    longest = os.pathconf(there, "PC_NAME_MAX") - len(
        ".manitwin-12345.replaced"
    )  # files are written beside their final place first
    if any(len(os.fsencode(name)) > longest for name in folder.absolute().parts[len(there.absolute().parts) :]):
        raise OSError(errno.ENAMETOOLONG, os.strerror(errno.ENAMETOOLONG))


def _require_writable(place: Path, *, made: bool) -> None:
    """Raise OSError if a folder cannot be written; ``made``: or if no folder can be made in it (/proc)."""
    if made:
        os.rmdir(tempfile.mkdtemp(prefix=".manitwin-", dir=place))
    elif not os.access(place, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def _named(place: Path, folder: Path) -> str:
    return "" if place == folder else f"{place} is "
