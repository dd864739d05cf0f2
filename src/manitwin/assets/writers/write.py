"""A twin in a format on disk: one folder a format, whole or not at all."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path, PurePosixPath

from manitwin.assets.writers.content import TwinContent
from manitwin.assets.writers.exporter import Exported
from manitwin.assets.writers.licenses import LICENSE_FILE, check_license, license_text
from manitwin.assets.writers.readme import README_FILE, readme
from manitwin.assets.writers.registry import exporter
from manitwin.errors import ExportError
from manitwin.twin.store import replace_folder

MAX_NAME = 255
"""The bytes that a file name may have on ext4, APFS and NTFS alike."""

_FORBIDDEN = frozenset('<>:"|?*\\')  # Windows takes none of them, and what it takes for a separator is no name here


def export_twin(
    twin: TwinContent, format_name: str, out: str | Path, *, license_allow: Iterable[str] | None = None
) -> Path:
    """Write a twin to ``out/<twin name>/<format>/`` with README.md and LICENSE.txt; returns the file to open.

    An earlier export there is replaced. The same twin gives the same bytes. Raises UsageError for an unknown format,
    ExportError for a licence that is not allowed, a twin that the format cannot take, or a folder that cannot be written.
    """
    check_license(twin.record, license_allow)
    exported = exporter(format_name)(twin)
    texts = {README_FILE: readme(twin, format_name, exported), LICENSE_FILE: license_text(twin.record)}
    whole = replace(exported, files={**exported.files, **{name: text.encode() for name, text in texts.items()}})
    return write_exported(whole, Path(out) / safe_name(twin.name, one=True) / format_name)


def write_exported(exported: Exported, folder: Path) -> Path:
    """Write the files below ``folder``, which is renamed into place when all are there; returns the path of ``main``.

    Raises ExportError for a name that leaves the folder, before anything is written, and where writing fails.
    """
    names = {name: PurePosixPath(safe_name(name)) for name in exported.files}
    if exported.main not in names:
        raise ExportError(f"{folder}: the file to open, {exported.main!r}, is not among those written")
    if len({name.casefold() for name in names}) < len(names):
        raise ExportError(f"{folder}: two file names differ in case only; not every file system keeps both")
    fresh = folder.with_name(f".{folder.name}.{os.getpid()}")
    try:
        shutil.rmtree(fresh, ignore_errors=True)
        for name, data in sorted(exported.files.items()):
            place = fresh / names[name]
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(data)
        replace_folder(fresh, folder)
    except OSError as error:
        raise ExportError(f"{folder}: not written ({error}); mend that and export again") from error
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
    return folder / names[exported.main]


def safe_name(name: str, *, one: bool = False) -> str:
    """Return a relative ``/``-separated name that stays in its folder; ``one``: of one part. Raises ExportError for any other."""
    parts = name.split("/")
    fine = len(parts) == 1 or not one
    fine = fine and all(
        part not in ("", ".", "..")
        and part == part.strip(" ")
        and part.isprintable()
        and not _FORBIDDEN & set(part)
        and len(part.encode()) <= MAX_NAME
        for part in parts
    )
    if not fine:
        raise ExportError(f"{name!r}: no name for a file below the export's folder; nothing is written")
    return name
