"""MJCF: the first object of it that is rigid, by MuJoCo's own parser and compiler."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import trimesh
from trimesh.visual.material import PBRMaterial

from manitwin.assets import primitives
from manitwin.assets.asset import Asset, CollisionShape, Contact, Inertial, combined_inertial
from manitwin.assets.asset_files import AssetFiles, joined
from manitwin.assets.licence_text import stated_licence
from manitwin.assets.read import only_file
from manitwin.assets.readers.mjcf_model import NO_OBJECTS, CompiledMjcf, MjcfSource, compiled, open_mjcf
from manitwin.assets.root import root_of
from manitwin.errors import AssetError
from manitwin.formats.meshes.textures import (
    bake_transform,
    make_part,
    material_of,
    normals_of,
    pbr_material,
    srgb_to_linear,
    uv_of,
)
from manitwin.geometry.poses import inverse, rotation_from_quaternion_wxyz, transform

_INERTIA_FROM_GEOM = 1  # mjtInertiaFromGeom: true; 2 is auto
_SHOWN_GROUPS = 3  # MuJoCo's viewer shows groups 0 to 2 (mjvOption.geomgroup)
_KINDS = mujoco.mjtGeom
_WORLD = 0
_SHEET_M, _UNBOUNDED_M = 1e-3, 1.0  # how thick a plane is shown, and how wide one without an end
_MESH_KINDS = (int(_KINDS.mjGEOM_MESH), int(_KINDS.mjGEOM_SDF))


def read(path: Path, root: Path | None = None) -> Asset:
    """Read an MJCF file, or the only one in a folder; the asset's axes are those of the object's first body.

    Defaults, frames and shapes are resolved by MuJoCo; meshes and textures are read here, below ``root`` (``root_of`` the path
    by default). An <inertial> is what the file declares; a mass that follows from a geom's mass or density that the file writes
    is kept with the centre and inertia that MuJoCo computes of it, with a remark; what only MuJoCo's own default density gives
    is not declared. A file of planes alone is shown as sheets. Raises AssetError naming what is broken. Source: the MJCF
    reference of MuJoCo.
    """
    file = only_file(path) if path.is_dir() else path
    files = AssetFiles(root or root_of(path), file.resolve().parent)
    files.used.add(file.resolve())
    source = open_mjcf(file, files)
    result = compiled(source, files)
    spec, model = result.spec, result.model
    bodies = _rigid_bodies(file, model, files)
    shapes = BodyShapes(result, files, planes=not any(_is_solid(model, index) for index, _ in bodies))
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
        static=_stands_fast(model, bodies[0][0]),
        license=licence,
        attribution=attribution,
        files=files.sorted_files(),
        missing_files=files.missing_names(),
        remarks=tuple(files.remarks),
        partial=files.partial,
    )


def _rigid_bodies(file: Path, model: Any, files: AssetFiles) -> list[tuple[int, np.ndarray]]:
    """Return the bodies of a rigid group that has a geom, with their poses in the group's first body.

    It is the first one that a free joint lets go, else the first.
    """
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
    world = [(_WORLD, np.eye(4))]  # shapes fixed to it: a static object
    shaped = [g for g in groups.values() if any(_is_solid(model, index) for index, _ in g)]
    shaped.sort(key=lambda group: not _is_free(model, group[0][0]))
    if not shaped:
        if _is_solid(model, _WORLD):
            return world
        if files.missing and groups:  # whose meshes are not there
            return next(iter(groups.values()))
        if model.ngeom:
            return next((g for g in groups.values() if any(model.body_geomnum[index] for index, _ in g)), world)
        raise AssetError(f"{file.name}: no body of it has a geom")
    files.remark_left_out([f"body {model.body(g[0][0]).name!r} moves by itself" for g in shaped[1:]], "bodies")
    return shaped[0]


def _stands_fast(model: Any, body: int) -> bool:
    """Tell whether a body is the world, or has no joint where others have some: a program adds that of a single object."""
    return body == _WORLD or (model.njnt > 0 and int(model.body_weldid[body]) == _WORLD)


def _is_free(model: Any, body: int) -> bool:
    first = int(model.body_jntadr[body])
    return first >= 0 and int(model.jnt_type[first]) == int(mujoco.mjtJoint.mjJNT_FREE)


def _is_solid(model: Any, body: int) -> bool:
    """Tell whether a body has a shape that is no plane."""
    start, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    return any(int(model.geom_type[geom]) != int(_KINDS.mjGEOM_PLANE) for geom in range(start, start + count))


def _declared_inertial(
    source: MjcfSource, spec: Any, model: Any, bodies: list[tuple[int, np.ndarray]], files: AssetFiles
) -> Inertial:
    by_index = {body.id: body for body in spec.bodies}
    forced = int(spec.compiler.inertiafromgeom) == _INERTIA_FROM_GEOM
    massive = [(index, pose) for index, pose in bodies if model.body_mass[index] > 0]
    explicit = [index for index, _ in bodies if by_index[index].explicitinertial and not forced]
    if explicit and all(index in explicit for index, _ in massive):
        return combined_inertial([_inertial(model, index, pose) for index, pose in bodies if index in explicit])
    if explicit or not source.writes(("mass", "density")) or files.lacks_a_mesh:  # of which nothing is known
        return Inertial()
    files.remark("its mass follows from a mass or density written for its geoms; centre and inertia are MuJoCo's own")
    found = combined_inertial([_inertial(model, index, pose) for index, pose in massive]) if massive else Inertial(0.0)
    return replace(found, computed=True)


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


class BodyShapes:
    """Reads the geoms of one compiled file; ``planes``: as sheets, of what has no other shape."""

    def __init__(self, compiled: CompiledMjcf, files: AssetFiles, *, planes: bool = False):
        self._compiled, self._model, self._files, self._planes = compiled, compiled.model, files, planes

    def of(
        self, bodies: list[tuple[int, np.ndarray]]
    ) -> tuple[tuple[trimesh.Trimesh, ...], tuple[CollisionShape, ...]]:
        """Return the visual parts and the collision shapes of bodies with their poses.

        A geom collides where contype or conaffinity is not zero. Visual are the others in a group that the viewer shows, with
        the colliding ones of the same groups; where there are none, the colliding ones in such a group.
        """
        colliding = set(self.colliding(bodies))
        visual: dict[bool, list[trimesh.Trimesh]] = {True: [], False: []}
        collision = []
        groups = {int(self._model.geom_group[geom]) for geom, _ in self._geoms(bodies) if geom not in colliding}
        for geom, body_to_asset in self._geoms(bodies):
            parts = self._parts(geom, body_to_asset)
            if geom in colliding and parts:
                vertices, faces = joined(parts)
                name = self._model.geom(geom).name or f"geom_{geom:02d}"
                primitive = int(self._model.geom_type[geom]) not in _MESH_KINDS
                collision.append(CollisionShape(name, vertices, faces, True, primitive=primitive))
            if self._model.geom_group[geom] < _SHOWN_GROUPS:
                visual[geom in colliding and int(self._model.geom_group[geom]) not in groups] += parts
        return tuple(visual[False] or visual[True]), tuple(collision)

    def colliding(self, bodies: list[tuple[int, np.ndarray]]) -> list[int]:
        """Return the geoms of bodies that collide."""
        model = self._model
        return [g for g, _ in self._geoms(bodies) if model.geom_contype[g] or model.geom_conaffinity[g]]

    def _geoms(self, bodies: list[tuple[int, np.ndarray]]) -> list[tuple[int, np.ndarray]]:
        starts, counts = self._model.body_geomadr, self._model.body_geomnum
        return [(int(starts[body]) + i, pose) for body, pose in bodies for i in range(int(counts[body]))]

    def _parts(self, geom: int, body_to_asset: np.ndarray) -> list[trimesh.Trimesh]:
        model = self._model
        pose = body_to_asset @ transform(rotation_from_quaternion_wxyz(model.geom_quat[geom]), model.geom_pos[geom])
        material = self._material(geom)
        if int(model.geom_type[geom]) in _MESH_KINDS:
            return self._mesh(geom, pose, material)
        kind, size = int(model.geom_type[geom]), np.array(model.geom_size[geom])
        solid = _sheet(size) if self._planes and kind == int(_KINDS.mjGEOM_PLANE) else _primitive(kind, size)
        if solid is None:
            self._files.remark(NO_OBJECTS)
            return []
        self._files.count(len(solid.faces))
        name = model.geom(geom).name or f"geom_{geom:02d}"
        return [bake_transform(make_part(solid.vertices, solid.faces, material=material, name=name), pose)]

    def _mesh(self, geom: int, pose: np.ndarray, material: PBRMaterial) -> list[trimesh.Trimesh]:
        model, mesh = self._model, int(self._model.geom_dataid[geom])
        parts = self._compiled.meshes.get(model.mesh(mesh).name)
        if parts is None:  # written out in the file: as MuJoCo has it, in the frame of its inertia
            vertices, faces = _written_out(model, mesh)
            self._files.count(len(faces))
            return [bake_transform(make_part(vertices, faces, material=material, name=model.mesh(mesh).name), pose)]
        self._files.count(sum(len(part.faces) for part in parts))
        inertia_to_mesh = transform(rotation_from_quaternion_wxyz(model.mesh_quat[mesh]), model.mesh_pos[mesh])
        to_asset = pose @ inverse(inertia_to_mesh)
        return [bake_transform(_dressed(part, material), to_asset) for part in parts]

    def _material(self, geom: int) -> PBRMaterial:
        model, index = self._model, int(self._model.geom_matid[geom])
        rgba = np.array(model.geom_rgba[geom] if index < 0 else model.mat_rgba[index], float)
        name = None if index < 0 else model.mat(index).name
        alpha = float(np.clip(rgba[3], 0, 1))
        return pbr_material(
            name,
            base_color=(*srgb_to_linear(np.clip(rgba[:3], 0, 1)), alpha),
            base_color_texture=None if name is None else self._compiled.textures.get(name),
            alpha_mode="BLEND" if alpha < 1 else None,
        )


def _dressed(part: trimesh.Trimesh, material: PBRMaterial) -> trimesh.Trimesh:
    """Return the part with the material of the MJCF file, unless only the mesh file has a picture."""
    own = material_of(part)
    if own.baseColorTexture is not None and material.baseColorTexture is None:
        return part
    return make_part(
        part.vertices,
        part.faces,
        material=material,
        name=part.metadata["name"],
        uv=uv_of(part),
        normals=normals_of(part),
    )


def _written_out(model: Any, mesh: int) -> tuple[np.ndarray, np.ndarray]:
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    face, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    return np.array(model.mesh_vert[first : first + count], float), np.array(model.mesh_face[face : face + faces], int)


def _sheet(size: np.ndarray) -> trimesh.Trimesh:
    """Return a plane as a sheet under it: half lengths, of which 0 has no end (MJCF reference, geom type)."""
    sides = [2 * float(half) if half > 0 else _UNBOUNDED_M for half in size[:2]]
    sheet = trimesh.creation.box((*sides, _SHEET_M))
    sheet.apply_translation((0, 0, -_SHEET_M / 2))
    return sheet


def _primitive(kind: int, size: np.ndarray) -> trimesh.Trimesh | None:
    """Return a geom's mesh: sizes are half lengths (MJCF reference, geom size)."""
    if kind == int(_KINDS.mjGEOM_BOX):
        return trimesh.creation.box(2 * size)
    if kind == int(_KINDS.mjGEOM_SPHERE):
        return primitives.sphere(float(size[0]))
    if kind == int(_KINDS.mjGEOM_CYLINDER):
        return primitives.cylinder(float(size[0]), 2 * float(size[1]))
    if kind == int(_KINDS.mjGEOM_CAPSULE):
        return primitives.capsule(float(size[0]), 2 * float(size[1]))
    if kind == int(_KINDS.mjGEOM_ELLIPSOID):
        return primitives.ellipsoid(size)
    return None
