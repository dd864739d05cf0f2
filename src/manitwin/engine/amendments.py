"""Amendments: manual corrections of an item, read by the stages that they concern, whose keys change with them.

They are stored in ``amendments/<2 hex>/<item_id>.json`` below a data set's root: a JSON object with one entry per stage. They
are not part of the item's identity, and apply to every later run on that data set.
"""

from __future__ import annotations

from typing import Any

from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import canonical_json, sha256_of_json

AMENDMENTS = "amendments"
_REMEDY = "repair it, or remove it"
Amendments = dict[str, dict[str, Any]]
"""Corrected values for a stage to use instead of its own, by stage name."""


def amendments_name(item_id: str) -> str:
    """Return the path of an item's amendments relative to the data set's root."""
    return f"{AMENDMENTS}/{item_id[:2]}/{item_id}.json"


def read_amendments(root: DatasetRoot, item_id: str) -> Amendments:
    """Return an item's amendments, empty if there is no file. Raises UsageError for a malformed file."""
    name = amendments_name(item_id)
    try:
        said = root.read_json(name, UsageError, remedy=_REMEDY)
    except FileNotFoundError:
        return {}
    if not all(isinstance(each, dict) for each in said.values()):
        raise UsageError(f"{name}: does not contain a JSON object keyed by stage; {_REMEDY}")
    return said


def write_amendments(root: DatasetRoot, item_id: str, amendments: Amendments) -> None:
    """Write an item's amendments atomically, replacing earlier ones."""
    root.write_bytes(amendments_name(item_id), canonical_json(amendments).encode())


def amendments_sha256(amendments: Amendments) -> str | None:
    """Return the digest of amendments; None if there are none."""
    return sha256_of_json(amendments) if amendments else None
