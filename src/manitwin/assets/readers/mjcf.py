"""MJCF: the first object of it that is rigid, by MuJoCo's own parser and compiler."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from manitwin.assets.asset import Asset, Contact, Inertial, combined_inertial
from manitwin.assets.asset_files import AssetFiles
from manitwin.assets.detect import only_file
from manitwin.assets.licence_text import stated_licence
from manitwin.assets.readers.mjcf_shapes import BodyShapes
from manitwin.assets.readers.mjcf_source import MjcfSource, open_mjcf
from manitwin.assets.readers.mjcf_spec import compiled
from manitwin.errors import AssetError
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform

_INERTIA_FROM_GEOM = 1  # mjtInertiaFromGeom: true; 2 is auto


def read(path: Path) -> Asset:
    """Read an MJCF file, or the only one in a folder; the asset's axes are those of the object's first body.

    Defaults, frames and shapes are resolved by MuJoCo; meshes and textures are read here, below the file's folder. An
    <inertial> is what the file declares; a mass that follows from a geom's mass or density that the file writes is kept
    without a centre and inertia, with a remark; what only MuJoCo's own default density gives is not declared. Raises
    AssetError naming what is broken. Source: the MJCF reference of MuJoCo.
    """
    file = only_file(path) if path.is_dir() else path
    files = AssetFiles(path if path.is_dir() else file.resolve().parent)
    files.used.add(file.resolve())
    source = open_mjcf(file, files)
    result = compiled(source, files)
    spec, model = result.spec, result.model
    bodies = _rigid_bodies(file, model, files)
    shapes = BodyShapes(result, files)
    visual, collision = shapes.of(bodies)
    names = [model.body(index).name for index, _ in bodies]
    licence, attribution = stated_licence(source.texts)
    return Asset(
        format="mjcf",
        path=path,
        name=names[0] or spec.modelname or file.stem,
        visual=tuple(visual),
        collision=tuple(collision),
        up="z",
        unit_m=1.0,
        inertial=_declared_inertial(source, spec, model, bodies, files),
        contact=_declared_contact(source, model, shapes.colliding(bodies), files),
        license=licence,
        attribution=attribution,
        files=files.sorted_files(),
        missing_files=files.missing_names(),
        remarks=tuple(files.remarks),
    )


def _rigid_bodies(file: Path, model: Any, files: AssetFiles) -> list[tuple[int, np.ndarray]]:
    """Return the bodies of the first rigid group that has a geom, with their poses in the group's first body."""
    groups: dict[int, list[tuple[int, np.ndarray]]] = {}
    head_of: dict[int, int] = {0: 0}
    poses: dict[int, np.ndarray] = {0: np.eye(4)}
    for index in range(1, model.nbody):
        parent = int(model.body_parentid[index])
        starts = parent == 0 or model.body_jntnum[index] > 0
        head_of[index] = index if starts else head_of[parent]
        own = transform(rotation_from_quaternion_wxyz(model.body_quat[index]), model.body_pos[index])
        poses[index] = np.eye(4) if starts else poses[parent] @ own
        groups.setdefault(head_of[index], []).append((index, poses[index]))
    shaped = [g for g in groups.values() if any(model.body_geomnum[index] > 0 for index, _ in g)]
    if not shaped:
        if model.body_geomnum[0] > 0:  # shapes fixed to the world: a static object
            return [(0, np.eye(4))]
        raise AssetError(f"{file.name}: no body of it has a geom")
    for group in shaped[1:]:
        files.remark(
            f"body {model.body(group[0][0]).name!r} moves by itself and was left out: one rigid object is read"
        )
    return shaped[0]


def _declared_inertial(
    source: MjcfSource, spec: Any, model: Any, bodies: list[tuple[int, np.ndarray]], files: AssetFiles
) -> Inertial:
    by_index = {body.id: body for body in spec.bodies}
    forced = int(spec.compiler.inertiafromgeom) == _INERTIA_FROM_GEOM
    massive = [(index, pose) for index, pose in bodies if model.body_mass[index] > 0]
    explicit = [index for index, _ in bodies if by_index[index].explicitinertial and not forced]
    if explicit and all(index in explicit for index, _ in massive):
        return combined_inertial([_inertial(model, index, pose) for index, pose in bodies if index in explicit])
    if explicit or not source.writes(("mass", "density")):
        return Inertial()
    files.remark("its mass follows from a mass or density written for its geoms; centre and inertia are MuJoCo's own")
    return Inertial(float(sum(model.body_mass[index] for index, _ in bodies)))


def _inertial(model: Any, index: int, body_to_asset: np.ndarray) -> Inertial:
    inertial_to_asset = body_to_asset @ transform(
        rotation_from_quaternion_wxyz(model.body_iquat[index]), model.body_ipos[index]
    )
    rotation = inertial_to_asset[:3, :3]
    tensor = rotation @ np.diag(model.body_inertia[index]) @ rotation.T
    return Inertial(float(model.body_mass[index]), inertial_to_asset[:3, 3], tensor)


def _declared_contact(source: MjcfSource, model: Any, geoms: list[int], files: AssetFiles) -> Contact:
    """Return the sliding friction (MuJoCo has one coefficient, sticking or sliding) where the file writes any."""
    if not geoms or not source.writes(("friction",)):
        return Contact()
    sliding = [float(model.geom_friction[geom, 0]) for geom in geoms]
    if max(sliding) > min(sliding):
        files.remark(f"its geoms have frictions from {min(sliding):g} to {max(sliding):g}; the first was taken")
    return Contact(sliding[0], sliding[0])
