"""Digests of the parts of a twin's record on which scenes and episodes depend: its body and its grippers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from manitwin.errors import TwinError
from manitwin.twin.store import REMEDY, sha256_of_json

_COLLISION = "collision/"
_OF_BODY = ("mass_kg", "center_of_mass_m", "inertia_kg_m2", "friction_static", "friction_dynamic", "restitution")


@dataclass(frozen=True)
class TwinState:
    """The state of a twin on which derived data depends: revision, ``body_sha256``, and digests of gripper files by gripper
    name.
    """

    revision: str
    body_sha256: str
    grippers: Mapping[str, str] = field(default_factory=dict)


def twin_state(record: Mapping[str, Any], name: str) -> TwinState:
    """Return the state of a twin from its twin.json in the current schema version.

    Raises TwinError with ``name`` if a required value is missing.
    """
    try:
        return TwinState(record["revision"], body_sha256(record), gripper_digests(record))
    except (KeyError, TypeError, AttributeError) as error:
        raise TwinError(f"{name}: not a record of a twin ({type(error).__name__}: {error}); {REMEDY}") from error


def body_sha256(record: Mapping[str, Any]) -> str:
    """Return the digest of everything that determines how a twin comes to rest: hulls, mass and contact properties, placements.

    ``record`` is the content of a twin.json in the current schema version. Descriptions, points, grasps, appearance and the
    sources of numbers are not included: amending them changes the revision but not this digest.
    """
    physical, files = record.get("physical") or {}, record.get("files") or {}
    return sha256_of_json(
        {
            "hulls": {name: digest for name, digest in files.items() if name.startswith(_COLLISION)},
            "physical": {name: _value(physical.get(name)) for name in _OF_BODY},
            "placements": [
                [each["position_m"], each["quaternion_wxyz"], each["settled"]]
                for each in record.get("placements") or ()
            ],
        }
    )


def gripper_digests(record: Mapping[str, Any]) -> dict[str, str]:
    """Return the digests of the definitions of all grippers with grasps in a twin, by name.

    ``record`` is the content of a twin.json in the current schema version.
    """
    first = record.get("grasps")
    if first is None:
        return {}
    others = {name: other["summary"] for name, other in first.get("other_grippers", {}).items()}
    summaries = {first["gripper"]: first, **others}
    return {name: summary["gripper_sha256"] for name, summary in summaries.items() if summary is not None}


def _value(said: Any) -> Any:
    return said["value"] if isinstance(said, Mapping) else said
