"""What people have put right of an item: read by the stages that it concerns, whose results then have other keys.

``amendments/<2 hex>/<item_id>.json`` below a data set's root holds an object by stage name. It is no part of the item's identity,
and holds for every later run there.
"""

from __future__ import annotations

from typing import Any

from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import canonical_json, sha256_of_json

AMENDMENTS = "amendments"
_REMEDY = "repair it, or remove it"
Amendments = dict[str, dict[str, Any]]
"""Values that a stage takes in place of its own, by the stage's name."""


def amendments_name(item_id: str) -> str:
    """Return the name of an item's amendments below the root."""
    return f"{AMENDMENTS}/{item_id[:2]}/{item_id}.json"


def read_amendments(root: DatasetRoot, item_id: str) -> Amendments:
    """Return an item's amendments, none where there is no file; raises UsageError for a file that holds none."""
    name = amendments_name(item_id)
    try:
        said = root.read_json(name, UsageError, remedy=_REMEDY)
    except FileNotFoundError:
        return {}
    if not all(isinstance(each, dict) for each in said.values()):
        raise UsageError(f"{name}: does not contain a JSON object keyed by stage; {_REMEDY}")
    return said


def write_amendments(root: DatasetRoot, item_id: str, amendments: Amendments) -> None:
    """Write an item's amendments in place of earlier ones, whole or not at all."""
    root.write_bytes(amendments_name(item_id), canonical_json(amendments).encode())


def amendments_sha256(amendments: Amendments) -> str | None:
    """Return the digest of amendments, None of none."""
    return sha256_of_json(amendments) if amendments else None
