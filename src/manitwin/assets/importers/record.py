"""Import record of an asset: its declared properties in the object frame of twins, what is missing, and what was dropped."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
import trimesh
from pydantic import ValidationError

from manitwin.assets.asset import AnnotatedFrame, AnnotatedGrasps, Asset
from manitwin.assets.asset_files import OUTSIDE
from manitwin.assets.importers.asset_name import informative_name, split_words
from manitwin.assets.importers.dropped import (
    CENTER,
    INERTIA,
    center_outside_visual,
    impossible_mass_properties,
    inertia_without_mass,
    unused_content,
    without_placeholder_mass,
)
from manitwin.assets.importers.links import given_articulation
from manitwin.assets.root import PACKAGE_MARKS
from manitwin.errors import AssetError
from manitwin.formats.meshes.source import PACKAGE_SCHEMES
from manitwin.geometry.canonical_frame import object_frame
from manitwin.geometry.poses import GLTF_TO_OBJECT, inverse, transform_points
from manitwin.twin.import_record import MISSING_FILE, GivenGrasps, GivenPoint, ImportRecord

MAX_FRICTION = 10.0
"""Above any coefficient of dry friction: clean metals that seize reach about 5."""

_UP_TO_Z = {"z": np.eye(3), "y": GLTF_TO_OBJECT[:3, :3]}
_OF_TOOLS = frozenset({"vhacd", "coacd", "textured"})
"""Words that programs append to names when they decompose a mesh into hulls or texture it."""
_HEXADECIMAL = frozenset("0123456789abcdef")
_MAX_TEXTS, _MAX_LETTERS, _MAX_POINTS = 64, 500, 64
_MOST_ABOVE = 16
_OFF_M = 1e-3  # above the support plane an object drops by this much; below it, a simulator ejects it


def visible_parts(asset: Asset) -> tuple[trimesh.Trimesh, ...]:
    """Return the visual parts that have faces; raise AssetError if there are none."""
    parts = tuple(part for part in asset.visual if len(part.faces))
    if not parts:
        raise AssetError(f"{asset.path.name}: no visual mesh to make a twin of{_no_geometry_reason(asset)}")
    return parts


def asset_to_object(asset: Asset) -> np.ndarray:
    """Return the rigid transform ``(4, 4)`` from the asset's axes to the object frame of its visual meshes."""
    return object_frame(_visible_points(asset), _UP_TO_Z[asset.up])


def _visible_points(asset: Asset) -> np.ndarray:
    return np.concatenate([part.vertices[np.unique(part.faces)] for part in visible_parts(asset)])


def import_record(asset: Asset, to_object: np.ndarray) -> ImportRecord:
    """Return the import record of an asset; impossible values are dropped and listed as missing."""
    remarks = list(asset.remarks)
    if asset.static:
        remarks.append("its file says that it stands fast: its twin is a thing that moves")
    asset, placeholder = without_placeholder_mass(asset)
    numbers, missing, dropped = _numbers(asset)
    dropped = placeholder + dropped
    impossible = impossible_mass_properties(asset) | inertia_without_mass(asset.inertial)
    center = None if CENTER in impossible else asset.inertial.center_of_mass_m
    if center is not None and (why := center_outside_visual(center, _visible_points(asset))) is not None:
        center, impossible[CENTER] = None, why
    dropped += [f"{what}: {why}" for what, why in impossible.items()]
    functional = [_point(frame, to_object) for frame in asset.frames if frame.kind in ("functional", "target")]
    grasp = [_point(frame, to_object) for frame in asset.frames if frame.kind == "contact"]
    for points, what in ((functional, "functional"), (grasp, "grasp")):
        if len(points) > _MAX_POINTS:
            dropped.append(
                f"{len(points) - _MAX_POINTS} {what} points: the first {_MAX_POINTS} are enough to choose from"
            )
    articulation, wrong_links = given_articulation(asset, to_object)
    dropped += wrong_links
    rests, repairs = settled_rests(asset, to_object)
    remarks += repairs
    inertia = None if INERTIA in impossible else asset.inertial.inertia_kg_m2
    rotation = to_object[:3, :3]
    captions = list(dict.fromkeys(" ".join(text.split())[:_MAX_LETTERS] for text in asset.captions if text.strip()))
    if len(captions) > _MAX_TEXTS:
        dropped.append(f"{len(captions) - _MAX_TEXTS} captions: the first {_MAX_TEXTS} are enough to choose from")
    grasps = [_grasps(entry, to_object) for entry in asset.grasps if len(entry.held)]
    absent = {
        CENTER: asset.inertial.center_of_mass_m is None,
        INERTIA: asset.inertial.inertia_kg_m2 is None,
        "material": not asset.contact.material,
        "category": not asset.category,
        "captions": not captions,
        "functional points": not functional,
        "grasp points": not grasp,
        "grasps": not grasps,
        "resting poses": not rests,
        "collision shapes": not asset.collision,
        "licence": not asset.license,
    }
    missing += [what for what, is_absent in absent.items() if is_absent]
    missing += [f"{MISSING_FILE}{name}" for name in asset.missing_files]
    return _validated(
        asset,
        {
            "format": asset.format,
            "file": asset.path.name or asset.path.resolve().name,
            "name": _words(informative_name(asset.name, asset.path)) or "object",
            "category": asset.category or None,
            "license": asset.license,
            "attribution": asset.attribution,
            "asset_to_object": to_object.tolist(),
            "center_of_mass_m": None if center is None else (rotation @ center + to_object[:3, 3]).tolist(),
            "inertia_kg_m2": None if inertia is None else (rotation @ inertia @ rotation.T).tolist(),
            "material": asset.contact.material,
            "captions": captions[:_MAX_TEXTS],
            "functional_points": functional[:_MAX_POINTS],
            "grasp_points": grasp[:_MAX_POINTS],
            "grasps": grasps,
            "rests": [rest.tolist() for rest in rests],
            "missing": missing,
            "dropped": [*dropped, *unused_content(asset)],
            "remarks": list(dict.fromkeys(remarks)),
            "articulation": articulation,
            "friction_range": _friction_range(asset, numbers["friction_static"]),
            **numbers,
        },
    )


def _validated(asset: Asset, fields: dict[str, Any]) -> ImportRecord:
    try:
        return ImportRecord.model_validate(fields)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        raise AssetError(f"{asset.path.name}: {place}: {first['msg']}; mend it where it was made") from error


def _numbers(asset: Asset) -> tuple[dict[str, float | None], list[str], list[str]]:
    """Return mass, friction and restitution where possible, the names of missing values, and the reasons for dropped ones."""
    contact = asset.contact
    given = {
        "mass_kg": ("mass", asset.inertial.mass_kg, 0.0, np.inf),
        "friction_static": ("friction", contact.friction_static, 0.0, MAX_FRICTION),
        "friction_dynamic": ("dynamic friction", contact.friction_dynamic, 0.0, MAX_FRICTION),
        "restitution": ("restitution", contact.restitution, -1e-9, 1.0),
    }
    numbers: dict[str, float | None] = {}
    missing: list[str] = []
    dropped: list[str] = []
    for key, (what, value, above, at_most) in given.items():
        numbers[key] = value if value is not None and above < value <= at_most else None
        if value is None:
            missing.append(what)
        elif numbers[key] is None:
            missing.append(f"{what} (declared as {value:g})")
            dropped.append(f"{what}: {value:g} is none that an object can have")
    static, dynamic = numbers["friction_static"], numbers["friction_dynamic"]
    if static is not None and dynamic is not None and dynamic > static:
        numbers["friction_dynamic"] = None
        missing.append(f"dynamic friction (declared as {dynamic:g}, above the static {static:g})")
        dropped.append(f"dynamic friction: {dynamic:g} is above the static {static:g}")
    return numbers, missing, dropped


def _friction_range(asset: Asset, static: float | None) -> tuple[float, float] | None:
    """Return the range of the surfaces' friction, or None if there is none or the friction of the asset itself is impossible.

    A bound that is impossible is replaced by the friction of the asset itself.
    """
    if static is None or asset.contact.friction_range is None:
        return None
    low, high = asset.contact.friction_range
    return (low if low > 0 else static), (high if high <= MAX_FRICTION else static)


def _point(frame: AnnotatedFrame, to_object: np.ndarray) -> GivenPoint:
    rotation = to_object[:3, :3]
    position = rotation @ frame.frame_to_asset[:3, 3] + to_object[:3, 3]
    if frame.kind == "contact":
        normal = None
    else:
        normal = _unit(rotation @ frame.frame_to_asset[:3, 2])  # +Z points out of the object (twins, RoboTwin)
    return GivenPoint(
        position_m=position.tolist(),
        normal=normal,
        label=_words(frame.label)[:_MAX_LETTERS],
        approach=None if frame.approach is None else _unit(rotation @ frame.approach),
        closing=None if frame.closing is None else _unit(rotation @ frame.closing),
    )


def _grasps(entry: AnnotatedGrasps, to_object: np.ndarray) -> GivenGrasps:
    return GivenGrasps(
        gripper=entry.gripper,
        gripper_to_object=[(to_object @ pose).tolist() for pose in entry.gripper_to_asset],
        depth_m=entry.depth_m.tolist(),
        width_m=entry.width_m.tolist(),
        held=[bool(held) for held in entry.held],
    )


def _unit(vector: np.ndarray) -> list[float] | None:
    length = float(np.linalg.norm(vector))
    return (vector / length).tolist() if length > 1e-9 else None


def _words(name: str) -> str:
    """Split the name of a file or element into words, without leading and trailing numbers and digests.

    Trailing names of tools, such as V-HACD in ``duck_vhacd``, are removed too.
    """
    words = split_words(name).replace("_", " ").replace("-", " ").split()
    first, last = 0, len(words)
    while first < last - 1 and words[first].isdecimal():
        first += 1
    while last > first + 1 and (
        words[last - 1].isdecimal() or _is_digest(words[last - 1]) or _is_tool_word(words[last - 1])
    ):
        last -= 1
    return " ".join(words[first:last])


def _is_tool_word(word: str) -> bool:
    return word.lower() in _OF_TOOLS


def _is_digest(word: str) -> bool:
    return len(word) >= 8 and set(word) <= _HEXADECIMAL


def _no_geometry_reason(asset: Asset) -> str:
    lines: Iterator[str] = iter([*(f"{name} is missing" for name in asset.missing_files), *asset.remarks])
    first = next(lines, None)
    elsewhere = next((name for name in asset.missing_files if name.startswith(PACKAGE_SCHEMES)), None)
    outside = next((remark for remark in asset.remarks if OUTSIDE in remark), None)
    if elsewhere is None and outside is not None:
        return f" ({outside})"
    if elsewhere is not None:
        remedy = f"; give the folder that holds {_package(elsewhere)!r} too{_package_folder_hint(asset)}"
    else:
        remedy = "; put it where its file says" if asset.missing_files else "; give it a shape that is seen or collides"
    return f" ({first}){remedy}" if first else remedy


def _package_folder_hint(asset: Asset) -> str:
    """Return a phrase naming the closest package folder above an asset, whose folder may be named differently; or ""."""
    folders = itertools.islice(asset.path.resolve().parents, _MOST_ABOVE)
    found = next((folder for folder in folders if any((folder / mark).is_file() for mark in PACKAGE_MARKS)), None)
    return "" if found is None else f"; the package around it is {found}"


def _package(name: str) -> str:
    """Return the package or model in a name with a scheme: ``cup`` of model://cup/meshes/cup.dae."""
    return name.partition("://")[2].lstrip("/").partition("/")[0]


def settled_rests(asset: Asset, asset_to_object: np.ndarray) -> tuple[list[np.ndarray], list[str]]:
    """Return the resting poses, object frame to plane ``(4, 4)``, each with the lowest point on z = 0, and remarks.

    Published annotations often miss the true lowest point, so that their users lift objects by hand. The rotation is kept, and
    the height follows from the mesh.
    """
    points = [part.vertices[np.unique(part.faces)] for part in asset.visual if len(part.faces)]
    if not points or not asset.rests:
        return [], []
    vertices = np.concatenate(points)
    rests, remarks = [], []
    for number, declared in enumerate(asset.rests):
        lowest_m = float(transform_points(declared, vertices)[:, 2].min())
        rest = declared.copy()
        rest[2, 3] -= lowest_m
        rests.append(rest @ inverse(asset_to_object))
        if abs(lowest_m) > _OFF_M:
            where = "above" if lowest_m > 0 else "below"
            remarks.append(
                f"place {number} puts the lowest point {abs(lowest_m) * 1000:.1f} mm {where} the plane; it was set down on it"
            )
    return rests, remarks
