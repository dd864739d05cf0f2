"""Schema versions of files, to distinguish files of a newer package version from damaged ones."""

from __future__ import annotations

from typing import TypeGuard


def newer_schema_message(place: object, version: int, newest: int) -> str:
    """Return the error message for a file whose schema only a newer version of this package knows."""
    return f"{place}: of schema {version}, this version reads up to {newest}; use the version that wrote it, or a newer one"


def is_newer(version: object, newest: int) -> TypeGuard[int]:
    """Return whether a schema version stated in a file is later than the newest supported one."""
    return type(version) is int and version > newest
