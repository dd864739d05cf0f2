"""Migration of records of earlier schema versions when they are read; the files stay unchanged."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

SCHEMA_VERSION = 4


def migrate_record(record: dict[str, Any]) -> dict[str, Any]:
    """Return the content of a twin.json in the current schema version; content of an unknown version is returned unchanged.

    Values that an earlier version does not have are null or empty; nothing is computed.
    """
    while (step := _STEPS.get(_version(record))) is not None:
        record = step(record)
    return record


def _version(record: dict[str, Any]) -> int | None:
    version = record.get("schema_version")
    return version if type(version) is int else None


def _to_2(record: dict[str, Any]) -> dict[str, Any]:
    """Version 2 adds functional frames, refined candidates and parts; their defaults mean "not stated"."""
    return {**record, "schema_version": 2}


def _to_3(record: dict[str, Any]) -> dict[str, Any]:
    """Version 3 adds the fill states of closed vessels; their default means "not stated"."""
    return {**record, "schema_version": 3}


def _to_4(record: dict[str, Any]) -> dict[str, Any]:
    """Version 4 adds links and joints of articulated objects; their defaults mean a rigid object."""
    return {**record, "schema_version": 4}


_STEPS: dict[int | None, Callable[[dict[str, Any]], dict[str, Any]]] = {1: _to_2, 2: _to_3, 3: _to_4}
"""The migration steps, by the version that each starts from."""
