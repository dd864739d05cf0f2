"""Reader of RoboTwin object folders (1.0 and 2.0): one variant of a rigid object, as RoboTwin's own loader reads it.

Source: RoboTwin envs/utils/create_actor.py ``create_actor`` (file selection) and envs/utils/actor_utils.py.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from manitwin.assets.asset import Asset, CollisionShape, Contact, Inertial
from manitwin.assets.asset_files import AssetFiles
from manitwin.assets.read import robotwin_data
from manitwin.assets.readers.robotwin_data import RobotwinData, read_json
from manitwin.errors import AssetError
from manitwin.formats.meshes.textures import bake_transform
from manitwin.geometry.poses import GLTF_TO_OBJECT, OBJECT_TO_GLTF, transform

_NUMBERED = re.compile(r"^\d+_(.+)$")
_EXTENTS_TOLERANCE = 0.1
"""RoboTwin's own extents are those of an oriented box; a difference of a tenth indicates different axes rather than rounding."""


def read(path: Path) -> Asset:
    """Read a variant by its model_data file; for a folder, the variant with the lowest number.

    Meshes and the translations of frames are scaled as in RoboTwin; matrices are otherwise unchanged. Mass and friction come
    from a ``physics<ID>.json`` beside the file, if there is one; RoboTwin itself reads none for rigid objects. ``rests`` is the
    pose in which RoboTwin places an object marked ``stable``. Raises AssetError for an articulated object and for unreadable
    files.
    """
    variants = robotwin_data(path) if path.is_dir() else [path]
    if not variants:
        raise AssetError(f"{path}: no model_data file; it is no RoboTwin object")
    file = variants[0]
    folder, number = file.parent, "".join(filter(str.isdigit, file.stem))
    if (folder / "mobility.urdf").is_file():
        raise AssetError(f"{folder.name}: an articulated RoboTwin object (mobility.urdf); only rigid ones are read")
    data, files = RobotwinData.read(file), AssetFiles(folder)
    if file.is_file():
        files.used.add(file.resolve())
    scale = np.diag([*data.scale, 1.0])
    visual = _parts(files, folder, "visual", number, scale)
    collision = _parts(files, folder, "collision", number, scale)
    physics = read_json(folder / f"physics{number}.json")
    if physics:
        files.used.add((folder / f"physics{number}.json").resolve())
    frames = data.frames()
    shapes = tuple(
        CollisionShape(
            f"{i:02d}_{part.metadata['name']}", np.asarray(part.vertices), np.asarray(part.faces), True, source
        )
        for i, (part, source) in enumerate(collision)
    )
    described = _description(folder, number)
    category = described.get("raw_description")
    named = _NUMBERED.match(folder.name)
    return Asset(
        format="robotwin",
        path=path,
        name=folder.name if len(robotwin_data(folder)) < 2 else f"{folder.name}/base{number}",
        visual=tuple(part for part, _ in visual),
        collision=shapes,
        up="y",
        unit_m=1.0,
        inertial=_inertial(physics, file),
        contact=_contact(physics, file),
        category=category if isinstance(category, str) else (named.group(1).replace("_", " ") if named else None),
        captions=tuple(
            text for key in ("seen", "unseen") for text in _list(described.get(key)) if isinstance(text, str)
        ),
        frames=frames,
        rests=(transform(GLTF_TO_OBJECT[:3, :3]),) if data.content.get("stable") is True else (),
        license=None if data.text("license") == "unknown" else data.text("license"),
        attribution=data.text("attribution"),
        files=files.sorted_files(),
        missing_files=files.missing_names(),
        remarks=(*_other_variants(path, variants), *files.remarks, *data.remarks, *_extents_remark(data, shapes)),
    )


def _parts(
    files: AssetFiles, folder: Path, kind: str, number: str, scale: np.ndarray
) -> list[tuple[trimesh.Trimesh, Path]]:
    """Return the scaled parts of the mesh that RoboTwin would load: GLB before OBJ, in its subfolder before beside it."""
    names = (f"base{number}.glb", f"textured{number}.obj")
    candidates = [place / name for place in (folder / kind, folder) for name in names]
    found = files.find(f"{kind}/{names[0]}", candidates)
    return [] if found is None else [(bake_transform(part, scale), found) for part in files.mesh(found).parts]


def _other_variants(path: Path, variants: list[Path]) -> list[str]:
    if not path.is_dir() or len(variants) < 2:
        return []
    return [f"{len(variants)} variants; {variants[0].name} was read, name another by its file"]


def _extents_remark(data: RobotwinData, shapes: tuple[CollisionShape, ...]) -> list[str]:
    """Remark on declared extents that are not along the axes: RoboTwin's clutter code uses the second one as the height."""
    declared = data.content.get("extents")
    if not shapes or not isinstance(declared, list) or len(declared) != 3:
        return []
    said = data.array("extents", (3,)) * data.scale
    vertices = np.concatenate([shape.vertices for shape in shapes])
    true = np.ptp(vertices, axis=0)
    if (np.abs(said - true) <= _EXTENTS_TOLERANCE * max(float(true.max()), 1e-9)).all():
        return []
    return [f"extents: {_metres(said)} m by the file, {_metres(true)} m of the collision mesh along x, y, z"]


def _metres(values: np.ndarray) -> str:
    return " x ".join(f"{value:.4g}" for value in values)


def _description(folder: Path, number: str) -> dict[str, Any]:
    """Return RoboTwin's descriptions of the object, if its folder lies in ``<root>/assets/objects``."""
    objects = folder.resolve().parent
    if objects.name != "objects" or objects.parent.name != "assets":
        return {}
    root = objects.parent.parent / "description" / "objects_description"
    return read_json(root / folder.resolve().name / f"base{number}.json")


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _inertial(physics: dict[str, Any], file: Path) -> Inertial:
    """Return the mass properties from the physics file, rotated from the object frame to the Y-up axes of the mesh."""
    numbers = RobotwinData(file, physics)
    turn = OBJECT_TO_GLTF[:3, :3]
    center, tensor = physics.get("center_of_mass_m"), physics.get("inertia_kg_m2")
    return Inertial(
        _estimate(numbers, "mass_kg"),
        None if center is None else turn @ numbers.array("center_of_mass_m", (3,)),
        None if tensor is None else turn @ numbers.array("inertia_kg_m2", (3, 3)) @ turn.T,
    )


def _contact(physics: dict[str, Any], file: Path) -> Contact:
    numbers = RobotwinData(file, physics)
    return Contact(
        _estimate(numbers, "friction_static"),
        _estimate(numbers, "friction_dynamic"),
        _estimate(numbers, "restitution"),
        numbers.text("material"),
    )


def _estimate(numbers: RobotwinData, key: str) -> float | None:
    """Return the value of an estimate or a plain number; None if absent."""
    given = numbers.content.get(key)
    if given is None:
        return None
    value = given.get("value") if isinstance(given, dict) else given
    return float(RobotwinData(numbers.file, {key: value}).array(key, ()))
