"""MJCF reader: the first rigid object of a file, resolved by MuJoCo's own parser and compiler."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import trimesh

from manitwin.assets.articulation import Articulation, AssetLink, LinkTree
from manitwin.assets.asset import Asset, CollisionShape, Contact
from manitwin.assets.asset_files import MESH_LIMITS, AssetFiles
from manitwin.assets.joints import Joints
from manitwin.assets.licence_text import stated_licence
from manitwin.assets.read import only_file
from manitwin.assets.readers.joint_elements import mjcf_joints
from manitwin.assets.readers.mjcf_contents import COMPUTED, LEFT_OUT_COMPOSITE
from manitwin.assets.readers.mjcf_document import UNNAMED, MjcfSource, open_mjcf
from manitwin.assets.readers.mjcf_links import moving_bodies
from manitwin.assets.readers.mjcf_masses import DeclaredMasses
from manitwin.assets.readers.mjcf_model import CompiledMjcf, compile_mjcf
from manitwin.assets.readers.mjcf_shapes import BodyShapes, is_solid
from manitwin.assets.readers.mjcf_soft import rewrite_flexes_at_rest, soft_parts
from manitwin.assets.root import root_of
from manitwin.errors import AssetError
from manitwin.formats.meshes.source import MeshLimits
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform

_WORLD = 0


def read(
    path: Path,
    root: Path | None = None,
    limits: MeshLimits = MESH_LIMITS,
    *,
    joints: Joints = "part",
    number: int | None = None,
) -> Asset:
    """Read an MJCF file, or the only one in a folder; the asset's axes are those of the object's first body.

    MuJoCo resolves defaults, frames and shapes; meshes and textures are read here, below ``root`` (default: ``root_of`` the
    path). An <inertial> is declared. A mass that follows from a written geom mass or density is kept, with the centre and
    inertia that MuJoCo computes, and a remark. A mass that follows mostly from MuJoCo's default density is not declared.
    ``joints``: moving bodies are left out, locked in the pose of the file, or kept. ``number``: selects, from 0, one of the
    objects with a free joint (``count_objects``); if its body has no name, that of its mesh is used. A file with only planes
    and height fields yields sheets, one with only soft bodies their shape at rest. Raises AssetError naming what is broken.
    Source: MuJoCo's MJCF reference.
    """
    file = only_file(path) if path.is_dir() else path
    files = AssetFiles(root or root_of(path), file.resolve().parent, limits)
    files.used.add(file.resolve())
    source = open_mjcf(file, files)

    def chosen(model: Any) -> set[int]:
        aside = AssetFiles(files.root, missing=list(files.missing))  # its remarks would concern the whole model
        return {index for index, _ in _rigid_bodies(file, model, aside, joints, number)}

    result = compile_mjcf(source, files, chosen)
    if source.soft and not any(is_solid(result.model, body) for body in range(result.model.nbody)):
        return _soft_asset(path, file, AssetFiles(files.root, files.own, files.limits))
    spec, model = result.spec, result.model
    bodies = _rigid_bodies(file, model, files, joints, number)
    moving = moving_bodies(model, bodies, files) if joints == "keep" else None
    ground = not any(is_solid(model, index) for index, _ in bodies)
    shapes = BodyShapes(result, files, planes=ground)
    visual, collision = shapes.body_shapes(bodies)
    masses = DeclaredMasses(source, spec, model, files)
    articulation = None
    if moving is not None:
        visual, collision, articulation = _build_articulation(result, bodies, moving, shapes, masses)
        if source.acting:
            acting = ", ".join(sorted(source.acting))
            files.remark(f"what acts on its joints ({acting}) was left out: twins do not have it")
    licence, attribution = stated_licence(source.texts)
    return Asset(
        format="mjcf",
        path=path,
        name=_name(result, bodies[0][0], file, of_mesh=number is not None),
        visual=tuple(visual),
        collision=tuple(collision),
        up="z",
        unit_m=1.0,
        inertial=masses.inertial(bodies),
        contact=_declared_contact(source, model, shapes, bodies, files),
        static=ground or _is_fixed(model, bodies[0][0]),  # MuJoCo does not allow a plane to move
        license=licence,
        attribution=attribution,
        files=files.sorted_files(),
        missing_files=files.missing_names(),
        remarks=tuple(files.remarks),
        lenient=tuple(files.lenient),
        joints=mjcf_joints(model),
        partial=files.partial,
        articulation=articulation,
    )


def count_objects(path: Path, root: Path | None = None) -> int:
    """Return the number of objects with a free joint in an MJCF file; raises AssetError naming what is broken."""
    file = only_file(path) if path.is_dir() else path
    files = AssetFiles(root or root_of(path), file.resolve().parent, MESH_LIMITS)
    model = compile_mjcf(open_mjcf(file, files), files, lambda _: set()).model
    shaped = {int(model.body_rootid[body]) for body in range(1, model.nbody) if is_solid(model, body)}
    return sum(_is_free(model, head) for head in shaped)


def _name(result: CompiledMjcf, body: int, file: Path, *, of_mesh: bool) -> str:
    """Return the name of an object: of its first body, of that body's mesh (``of_mesh``), of the model, or of the file."""
    model, modelname = result.model, result.spec.modelname
    first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    meshes = [int(model.geom_dataid[geom]) for geom in range(first, first + count)] if of_mesh else []
    mesh_name = next((model.mesh(mesh).name for mesh in meshes if mesh >= 0), "")
    return str(model.body(body).name or mesh_name or (modelname if modelname != UNNAMED else "") or file.stem)


def _build_articulation(
    result: CompiledMjcf,
    bodies: list[tuple[int, np.ndarray]],
    moving: LinkTree,
    shapes: BodyShapes,
    masses: DeclaredMasses,
) -> tuple[tuple[trimesh.Trimesh, ...], tuple[CollisionShape, ...], Articulation]:
    """Return the shapes of the links in order, each as it would be shown alone, and the links with their joints."""
    by_link = [
        [body for body, of in zip(bodies, moving.link_of, strict=True) if of == link]
        for link in range(len(moving.heads))
    ]
    shown = [shapes.body_shapes(some) for some in by_link]
    links = (
        AssetLink(result.model.body(some[0][0]).name or f"body_{some[0][0]:02d}", masses.inertial(some))
        for some in by_link
    )
    owners = tuple(link for link, (visual, _) in enumerate(shown) for _ in visual)
    return (
        tuple(part for visual, _ in shown for part in visual),
        tuple(shape for _, collision in shown for shape in collision),
        Articulation(tuple(links), moving.joints, owners),
    )


def _soft_asset(path: Path, file: Path, files: AssetFiles) -> Asset:
    """Return the asset of an MJCF file with only soft bodies: their shapes at rest, in world axes."""
    files.used.add(file.resolve())
    source = open_mjcf(file, files, keep_soft=True)
    rewrite_flexes_at_rest(source, files)
    result = compile_mjcf(source, files)
    parts = tuple(soft_parts(result.model))
    if not parts and not files.missing:
        raise AssetError(
            f"{file.name}: none of its bodies has a geom, and no flex a surface; give an MJCF file with one"
        )
    files.remark("it is soft: its shape at rest was read, and nothing of what rigid bodies have")
    licence, attribution = stated_licence(source.texts)
    return Asset(
        format="mjcf",
        path=path,
        name=parts[0].metadata["name"] if parts else file.stem,
        visual=parts,
        collision=(),
        up="z",
        unit_m=1.0,
        soft=True,
        license=licence,
        attribution=attribution,
        files=files.sorted_files(),
        missing_files=files.missing_names(),
        remarks=tuple(files.remarks),
        lenient=tuple(files.lenient),
    )


def _rigid_bodies(
    file: Path, model: Any, files: AssetFiles, joints: Joints, number: int | None = None
) -> list[tuple[int, np.ndarray]]:
    """Return the bodies of one rigid group with a geom, with their poses ``(4, 4)`` in the group's first body.

    It is the first group with a free joint (or free group ``number``), otherwise the first in whose tree there is a joint,
    otherwise the first. With locked or kept joints, only free joints separate groups.
    """
    groups: dict[int, list[tuple[int, np.ndarray]]] = {}
    head_of: dict[int, int] = {0: 0}
    poses: dict[int, np.ndarray] = {0: np.eye(4)}
    for index in range(1, model.nbody):
        parent = int(model.body_parentid[index])
        moves = model.body_jntnum[index] > 0 and (joints == "part" or _is_free(model, index))
        starts = parent == 0 or moves
        head_of[index] = index if starts else head_of[parent]
        own = transform(rotation_from_quaternion_wxyz(model.body_quat[index]), model.body_pos[index])
        poses[index] = np.eye(4) if starts else poses[parent] @ own
        groups.setdefault(head_of[index], []).append((index, poses[index]))
    world = [(_WORLD, np.eye(4))]  # shapes fixed to the world: a static object
    shaped = [g for g in groups.values() if any(is_solid(model, index) for index, _ in g)]
    # a base without a joint carries moving bodies
    jointed = {int(model.body_rootid[body]) for body in model.jnt_bodyid}
    shaped.sort(key=lambda g: (not _is_free(model, g[0][0]), int(model.body_rootid[g[0][0]]) not in jointed))
    if not shaped:
        if is_solid(model, _WORLD):
            return world
        if files.missing:  # the meshes of its shapes
            return next(iter(groups.values()), world)
        if model.ngeom:
            return next((g for g in groups.values() if any(model.body_geomnum[index] for index, _ in g)), world)
        raise AssetError(
            f"{file.name}: none of its bodies has a geom{_non_rigid_clause(files.remarks)}; give an MJCF file with one"
        )
    if number is not None:
        free = [group for group in shaped if _is_free(model, group[0][0])]
        if number >= len(free):
            raise AssetError(f"{file.name}: {len(free)} of its objects are free to move; there is no number {number}")
        # the other free objects are requested by their own numbers
        shaped = [free[number], *(group for group in shaped if not _is_free(model, group[0][0]))]
    files.remark_left_out([_group_text(model, group) for group in shaped[1:]], "bodies")
    if joints == "lock":
        inside = {index for index, _ in shaped[0][1:]}  # the joints of the first body move the whole object
        files.remark_locked(
            [model.joint(j).name or f"joint_{j:02d}" for j in range(model.njnt) if int(model.jnt_bodyid[j]) in inside]
        )
    return shaped[0]


def _group_text(model: Any, group: list[tuple[int, np.ndarray]]) -> str:
    """Return the name of a group of bodies and whether it moves, for a remark."""
    head = group[0][0]
    name = model.body(head).name
    what = f"body {name!r}" if name else "an unnamed body"
    if _is_free(model, head):
        return f"{what} moves by itself"
    return f"{what} {'has joints' if any(model.body_jntnum[index] for index, _ in group) else 'is static'}"


def _non_rigid_clause(remarks: list[str]) -> str:
    """Return a clause on what the file has instead of geoms of rigid bodies."""
    if COMPUTED in remarks:
        return ", but those that a plug-in computes: it is code, and none is run"
    if LEFT_OUT_COMPOSITE in remarks:
        return ", but those of <composite>, which bends or moves in itself; only rigid bodies and <flexcomp> are read"
    return ""


def _is_fixed(model: Any, body: int) -> bool:
    """Return whether a body is fixed: the world itself, or a body without joint that is not the only object of the file.

    A single object without a joint counts as movable, because programs add a free joint to it.
    """
    if body == _WORLD or int(model.body_weldid[body]) != _WORLD:
        return body == _WORLD
    shaped = {int(model.body_rootid[index]) for index in range(1, model.nbody) if is_solid(model, index)}
    return model.njnt > 0 or len(shaped) > 1


def _is_free(model: Any, body: int) -> bool:
    first = int(model.body_jntadr[body])
    return first >= 0 and int(model.jnt_type[first]) == int(mujoco.mjtJoint.mjJNT_FREE)


def _declared_contact(
    source: MjcfSource, model: Any, shapes: BodyShapes, bodies: list[tuple[int, np.ndarray]], files: AssetFiles
) -> Contact:
    """Return the sliding friction, if the file writes any; MuJoCo has one coefficient for static and dynamic friction.

    A twin has one friction for its whole surface: that of the geoms with the largest total area, with the range of all as
    interval.
    """
    geoms = shapes.colliding(bodies)
    if not geoms or not source.has_geom_attribute(("friction",)):
        return Contact()
    named = {model.geom(geom).name for geom in geoms} - {""}
    if paired := sum(bool(pair & named) for pair in source.paired):
        files.remark(
            f"what <pair> says of its contact with other geoms ({paired}) was left out: a twin has one friction"
        )
    areas_m2: dict[float, float] = {}
    for geom in geoms:
        sliding = float(model.geom_friction[geom, 0])
        areas_m2[sliding] = areas_m2.get(sliding, 0.0) + shapes.areas_m2.get(geom, 0.0)
    most = max(areas_m2, key=lambda sliding: areas_m2[sliding])  # among equal areas, that of the first
    low, high = min(areas_m2), max(areas_m2)
    if low == high:
        return Contact(most, most)
    files.remark(
        f"its geoms have frictions from {low:g} to {high:g}; a twin has one: {most:g}, that of the most area, between these"
    )
    return Contact(most, most, friction_range=(low, high))
