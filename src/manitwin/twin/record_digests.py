"""What of a twin's record decides whether things made with it still hold: how it stands, and which grippers it was tried with."""

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
    """What a twin is now: its revision, its ``body_sha256``, and the digests of its grippers' files by their names."""

    revision: str
    body_sha256: str
    grippers: Mapping[str, str] = field(default_factory=dict)


def state_of(record: Mapping[str, Any], name: str) -> TwinState:
    """Return the state of a twin by the content of its twin.json in the present schema version.

    Raises TwinError naming ``name`` for one that lacks what it needs.
    """
    try:
        return TwinState(record["revision"], body_sha256(record), gripper_digests(record))
    except (KeyError, TypeError, AttributeError) as error:
        raise TwinError(f"{name}: not a record of a twin ({type(error).__name__}: {error}); {REMEDY}") from error


def body_sha256(record: Mapping[str, Any]) -> str:
    """Return the digest of what decides how a twin comes to rest: hulls, mass properties, contact properties and placements.

    ``record`` is the content of a twin.json in the present schema version. Words, points, grasps and the look of a twin are no
    part of it, nor is where a number is from: a twin that was amended in these has another revision, and this digest.
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
    """Return the digests of the files of all grippers that a twin has grasps of, by their names.

    ``record`` is the content of a twin.json in the present schema version.
    """
    first = record.get("grasps")
    if first is None:
        return {}
    others = {name: other["summary"] for name, other in first.get("other_grippers", {}).items()}
    summaries = {first["gripper"]: first, **others}
    return {name: summary["gripper_sha256"] for name, summary in summaries.items() if summary is not None}


def _value(said: Any) -> Any:
    return said["value"] if isinstance(said, Mapping) else said
