"""The places of ManiTwin-100K's annotations, and of its successor's: how an object is to be set down."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from manitwin.assets.asset_files import AssetFiles
from manitwin.errors import AssetError
from manitwin.formats.json_file import json_object, json_vector
from manitwin.geometry.poses import rotation_from_quaternion_wxyz

_KNOWN = frozenset({"position", "rotation", "face", "dimensions", "projection_circle"})
_MAX_PLACES = 1000


@dataclass(frozen=True)
class DeclaredPlace:
    """A way to set the object down: ``contact_m (3,)`` touches the support, ``axis_up (3,)`` points away from it."""

    name: str
    contact_m: np.ndarray
    axis_up: np.ndarray


def declared_places(annotations: dict[str, Any], file: str, files: AssetFiles) -> list[DeclaredPlace]:
    """Return ``active.place`` in the order of the file; raises AssetError for numbers that are none.

    Published: position is a point on the support, rotation the local axis that is to point upward. Successor:
    projection_circle.center is a pose (x, y, z, qw, qx, qy, qz) on the support, whose Z axis is taken as upward.
    """
    active = json_object(annotations.get("active"), f"{file}: active")
    for key in sorted(active.keys() - {"place"}):
        files.remark(f"{file}: active.{key[:40]} was not read")
    entries = json_object(active.get("place"), f"{file}: active.place")
    if len(entries) > _MAX_PLACES:
        raise AssetError(f"{file}: {len(entries)} places; no object has more than {_MAX_PLACES}")
    places = []
    for name, value in entries.items():
        what = f"{file}: place {name[:40]}"
        entry = json_object(value, what)
        for key in sorted(entry.keys() - _KNOWN):
            files.remark(f"{file}: {key[:40]!r} of a place was not read")
        place = _place(name, entry, what)
        if place is None:
            files.remark(f"{what} has neither a position with a rotation nor a projection circle")
        else:
            places.append(place)
    return places


def _place(name: str, entry: dict[str, Any], what: str) -> DeclaredPlace | None:
    circle = json_object(entry.get("projection_circle"), f"{what} projection_circle")
    if circle:
        pose = json_vector(circle.get("center"), 7, f"{what} center")
        if np.linalg.norm(pose[3:]) < 1e-6:
            raise AssetError(f"{what}: its quaternion is zero")
        return DeclaredPlace(name, pose[:3], rotation_from_quaternion_wxyz(pose[3:])[:, 2])
    if entry.get("position") is None or entry.get("rotation") is None:
        return None
    axis = json_vector(entry["rotation"], 3, f"{what} rotation")
    if np.linalg.norm(axis) < 1e-6:
        raise AssetError(f"{what}: its axis is zero")
    return DeclaredPlace(name, json_vector(entry["position"], 3, f"{what} position"), axis / np.linalg.norm(axis))
