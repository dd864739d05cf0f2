"""Reader of the published ManiTwin-100K layout: base_rescaled.glb with caption.json and manipulation_annotations.json."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from manitwin.assets.asset import Asset, Contact, Inertial
from manitwin.assets.asset_files import AssetFiles
from manitwin.errors import AssetError
from manitwin.formats.json_file import json_number, json_object, json_vector, read_json_object
from manitwin.formats.meshes.textures import bake_transform
from manitwin.geometry.poses import GLTF_TO_OBJECT, rotation_between, rotation_from_quaternion_wxyz, transform

ANNOTATIONS, CAPTIONS = "manipulation_annotations.json", "caption.json"
MESHES = ("base_rescaled.glb", "base_rescaled.usdz")
_KNOWN = frozenset({"bounding_box", "active", "physics"})
_SIDE_OFF = 0.02  # of the longest side: bounds farther apart are not those of this mesh
_MAX_CAPTIONS = 64
_PLACE_KEYS = frozenset({"position", "rotation", "face", "dimensions", "projection_circle"})
_MAX_PLACES = 1000


def read(path: Path) -> Asset:
    """Read the folder of an instance, such as ManiTwin-100K/mug/002; raises AssetError.

    The asset's axes are those of the annotations. The mesh is turned from Y up to Z up if only that matches the annotated
    bounding box. ``rests`` are the annotated places, with the contact point at the origin of the plane and the axis upward.
    Unknown fields are remarked, because the layout is known only from code that uses it.

    Source: DexVerse, scripts/asset_tools/download_selected_objects.py and object_annotations.py.
    """
    folder = path.parent if path.is_file() else path
    files = AssetFiles(folder)
    mesh_file = files.find(MESHES[0], [folder / name for name in MESHES])
    if mesh_file is None:
        raise AssetError(
            f"{folder}: has neither {' nor '.join(MESHES)}; give a folder of ManiTwin-100K that holds its mesh"
        )
    annotations = _annotations(folder, files)
    parts = files.mesh(mesh_file).parts
    to_asset, turned = _mesh_to_annotation_axes(np.concatenate([p.vertices for p in parts]), annotations, files)
    visual = tuple(bake_transform(part, to_asset) for part in parts)
    places = declared_places(annotations, ANNOTATIONS, files)
    category = folder.parent.name if folder.name.isdigit() else None
    captions, said = _captions(folder, files)
    return Asset(
        format="manitwin100k",
        path=path,
        name=f"{category} {folder.name}" if category else folder.name,
        visual=visual,
        collision=(),
        up=_up(places, turned),
        unit_m=1.0,
        inertial=_inertial(annotations),
        contact=_contact(annotations),
        category=said or (category.replace("_", " ") if category else None),
        captions=captions,
        rests=tuple(_rest(place) for place in places),
        files=files.sorted_files(),
        missing_files=files.missing_names(),
        remarks=tuple(files.remarks),
    )


def _annotations(folder: Path, files: AssetFiles) -> dict[str, Any]:
    file = files.find(ANNOTATIONS, [folder / ANNOTATIONS])
    if file is None:
        return {}
    annotations = read_json_object(file)
    for key in sorted(annotations.keys() - _KNOWN):
        value = annotations[key]
        size = f" of {len(value)}" if isinstance(value, dict | list) else ""
        files.remark(f"{ANNOTATIONS}: {key[:40]!r} was not read ({type(value).__name__}{size})")
    return annotations


def _mesh_to_annotation_axes(
    points: np.ndarray, annotations: dict[str, Any], files: AssetFiles
) -> tuple[np.ndarray, bool]:
    """Return the transform from the glTF mesh to the annotations' axes, and whether it turns Y up to Z up."""
    box = json_object(annotations.get("bounding_box"), "bounding_box")
    if not box:
        return np.eye(4), False
    said = np.array([json_vector(box.get(k), 3, f"bounding_box {k}") for k in ("min_bounds", "max_bounds")])
    limit = _SIDE_OFF * max(float(np.ptp(points, axis=0).max()), 1e-9)
    off = {}
    for turned, matrix in ((False, np.eye(4)), (True, GLTF_TO_OBJECT)):
        moved = points @ matrix[:3, :3].T
        off[turned] = float(np.abs(np.array([moved.min(0), moved.max(0)]) - said).max())
        if off[turned] <= limit:
            return matrix, turned
    files.remark(
        f"its bounding box is {min(off.values()) * 1000:.1f} mm off that of the mesh, which was measured instead"
    )
    return (GLTF_TO_OBJECT, True) if off[True] < off[False] else (np.eye(4), False)


def _up(places: list[DeclaredPlace], turned: bool) -> Literal["y", "z"]:
    """Return the vertical axis by the first annotated place, or that of the mesh, turned or not, if no place decides."""
    for place in places:
        axis = int(np.abs(place.axis_up).argmax())
        if place.axis_up[axis] > 0.9 and axis > 0:
            return "y" if axis == 1 else "z"
    return "z" if turned else "y"


def _rest(place: DeclaredPlace) -> np.ndarray:
    rotation = rotation_between(place.axis_up, np.array([0.0, 0, 1]))
    return transform(rotation, -rotation @ place.contact_m)


def _physics(annotations: dict[str, Any], key: str) -> float | None:
    physics = json_object(annotations.get("physics"), "physics")
    return None if physics.get(key) is None else json_number(physics[key], f"physics {key}")


def _inertial(annotations: dict[str, Any]) -> Inertial:
    return Inertial(_physics(annotations, "mass"))


def _contact(annotations: dict[str, Any]) -> Contact:
    static, dynamic, restitution = (
        _physics(annotations, key) for key in ("static_friction", "dynamic_friction", "restitution")
    )
    return Contact(static, dynamic, restitution)


def _captions(folder: Path, files: AssetFiles) -> tuple[tuple[str, ...], str | None]:
    """Return the sentences of caption.json, texts with more than two words, and its category."""
    file = files.find(CAPTIONS, [folder / CAPTIONS])
    if file is None:
        return (), None
    content = read_json_object(file)
    texts: list[str] = []
    for value in content.values():
        for entry in value if isinstance(value, list) else [value]:
            if isinstance(entry, str) and len(entry.split()) > 2:
                texts.append(" ".join(entry.split())[:500])
            elif not isinstance(entry, str):
                files.remark(f"{CAPTIONS}: an entry of type {type(entry).__name__} was not read")
    category = content.get("category")
    return tuple(dict.fromkeys(texts))[:_MAX_CAPTIONS], category if isinstance(category, str) and category else None


@dataclass(frozen=True)
class DeclaredPlace:
    """An annotated placement: ``contact_m (3,)`` touches the support, ``axis_up (3,)`` points away from it."""

    name: str
    contact_m: np.ndarray
    axis_up: np.ndarray


def declared_places(annotations: dict[str, Any], file: str, files: AssetFiles) -> list[DeclaredPlace]:
    """Return ``active.place`` in the order of the file; raises AssetError for malformed numbers.

    In the published layout, position is a point on the support and rotation the local axis that is to point upward. In its
    successor, projection_circle.center is a pose (x, y, z, qw, qx, qy, qz) on the support, whose Z axis is taken as upward.
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
        for key in sorted(entry.keys() - _PLACE_KEYS):
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
            raise AssetError(f"{what}: its quaternion is zero; give one of length 1, (w, x, y, z)")
        return DeclaredPlace(name, pose[:3], rotation_from_quaternion_wxyz(pose[3:])[:, 2])
    if entry.get("position") is None or entry.get("rotation") is None:
        return None
    axis = json_vector(entry["rotation"], 3, f"{what} rotation")
    if np.linalg.norm(axis) < 1e-6:
        raise AssetError(f"{what}: its axis is zero; give one of length 1")
    return DeclaredPlace(name, json_vector(entry["position"], 3, f"{what} position"), axis / np.linalg.norm(axis))
