"""Files that say the version of their schema: those of a newer version of this package are told from damaged ones."""

from __future__ import annotations

from typing import TypeGuard


def of_newer_schema(place: object, version: int, newest: int) -> str:
    """Return the one line about a file of a schema that only a newer version of this package knows."""
    return f"{place}: of schema {version}, this version reads up to {newest}; use the version that wrote it, or a newer one"


def is_newer(version: object, newest: int) -> TypeGuard[int]:
    """Tell whether what a file says of its schema is a later version than the newest that is known here."""
    return type(version) is int and version > newest
