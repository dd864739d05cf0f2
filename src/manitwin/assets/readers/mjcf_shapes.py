"""Geoms of bodies in a compiled MJCF file as visual parts and collision shapes."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import trimesh
from trimesh import triangles
from trimesh.visual.material import PBRMaterial

from manitwin.assets import primitives
from manitwin.assets.asset import CollisionShape
from manitwin.assets.asset_files import AssetFiles, concatenate_meshes
from manitwin.assets.readers.mjcf_model import NO_OBJECTS, CompiledMjcf
from manitwin.formats.meshes.textures import (
    bake_transform,
    color_of_lost_texture,
    make_part,
    material_of,
    normals_of,
    pbr_material,
    srgb_to_linear,
    uv_of,
)
from manitwin.geometry.poses import inverse, rotation_from_quaternion_wxyz, transform

SHOWN_GROUPS = 3
"""MuJoCo's viewer shows groups 0 to 2 (mjvOption.geomgroup)."""
_DEFAULT_RGBA = (0.5, 0.5, 0.5, 1.0)
"""Default colour; a geom with any other colour uses it instead of its material's (MJCF reference, geom/rgba)."""
_KINDS = mujoco.mjtGeom
_SHEET_M, _UNBOUNDED_M = 1e-3, 1.0  # shown thickness of a plane, and shown width of an infinite one
_GROUND_KINDS = (int(_KINDS.mjGEOM_PLANE), int(_KINDS.mjGEOM_HFIELD))
_MESH_KINDS = (int(_KINDS.mjGEOM_MESH), int(_KINDS.mjGEOM_SDF))


def is_solid(model: Any, body: int) -> bool:
    """Return whether a body has a visible or colliding shape that is neither a plane nor a height field."""
    start, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    solid = [geom for geom in range(start, start + count) if int(model.geom_type[geom]) not in _GROUND_KINDS]
    return any(model.geom_group[g] < SHOWN_GROUPS or collides(model, g) for g in solid)


def collides(model: Any, geom: int) -> bool:
    """Return whether a geom can collide."""
    return bool(model.geom_contype[geom] or model.geom_conaffinity[geom])


class BodyShapes:
    """Reads the geoms of one compiled file; ``planes``: also planes and height fields, as sheets, for files without other
    shapes.
    """

    def __init__(self, compiled: CompiledMjcf, files: AssetFiles, *, planes: bool = False):
        self._compiled, self._model, self._files, self._planes = compiled, compiled.model, files, planes
        self.areas_m2: dict[int, float] = {}  # of the colliding geoms that were read

    def body_shapes(
        self, bodies: list[tuple[int, np.ndarray]]
    ) -> tuple[tuple[trimesh.Trimesh, ...], tuple[CollisionShape, ...]]:
        """Return the visual parts and the collision shapes of bodies with their poses ``(4, 4)``.

        A geom collides if contype or conaffinity is not zero. Visual are the non-colliding geoms in a group that the viewer
        shows, and the colliding geoms of the same groups. If there are none, the colliding geoms in visible groups are visual.
        """
        colliding = set(self.colliding(bodies))
        visual: dict[bool, list[trimesh.Trimesh]] = {True: [], False: []}
        collision = []
        groups = {int(self._model.geom_group[geom]) for geom, _ in self._geoms(bodies) if geom not in colliding}
        for geom, body_to_asset in self._geoms(bodies):
            parts = self._parts(geom, body_to_asset)
            if geom in colliding and parts:
                vertices, faces = concatenate_meshes(parts)
                name = self._model.geom(geom).name or f"geom_{geom:02d}"
                self.areas_m2[geom] = float(triangles.area(vertices[faces]).sum())
                primitive = int(self._model.geom_type[geom]) not in _MESH_KINDS
                collision.append(CollisionShape(name, vertices, faces, True, primitive=primitive))
            if self._model.geom_group[geom] < SHOWN_GROUPS:
                visual[geom in colliding and int(self._model.geom_group[geom]) not in groups] += parts
        return tuple(visual[False] or visual[True]), tuple(collision)

    def colliding(self, bodies: list[tuple[int, np.ndarray]]) -> list[int]:
        """Return the colliding geoms of bodies."""
        model = self._model
        return [g for g, _ in self._geoms(bodies) if collides(model, g)]

    def _geoms(self, bodies: list[tuple[int, np.ndarray]]) -> list[tuple[int, np.ndarray]]:
        starts, counts = self._model.body_geomadr, self._model.body_geomnum
        return [(int(starts[body]) + i, pose) for body, pose in bodies for i in range(int(counts[body]))]

    def _parts(self, geom: int, body_to_asset: np.ndarray) -> list[trimesh.Trimesh]:
        model = self._model
        pose = body_to_asset @ transform(rotation_from_quaternion_wxyz(model.geom_quat[geom]), model.geom_pos[geom])
        if int(model.geom_type[geom]) in _MESH_KINDS:
            return self._mesh(geom, pose)
        material = self._material(geom, pictured=False)
        kind, size = int(model.geom_type[geom]), np.array(model.geom_size[geom])
        if self._planes and kind == int(_KINDS.mjGEOM_PLANE):
            solid: trimesh.Trimesh | None = _plane_sheet(size)
        elif self._planes and kind == int(_KINDS.mjGEOM_HFIELD):
            solid = _terrain(model, int(model.geom_dataid[geom]))
        else:
            solid = _primitive(kind, size)
        if solid is None:
            self._files.remark(NO_OBJECTS)
            return []
        self._files.count_shape(len(solid.faces))
        name = model.geom(geom).name or f"geom_{geom:02d}"
        return [bake_transform(make_part(solid.vertices, solid.faces, material=material, name=name), pose)]

    def _mesh(self, geom: int, pose: np.ndarray) -> list[trimesh.Trimesh]:
        model, mesh = self._model, int(self._model.geom_dataid[geom])
        parts = self._compiled.meshes.get(model.mesh(mesh).name)
        if parts is None:  # inline data, in MuJoCo's frame of the mesh inertia
            vertices, faces = _mesh_arrays(model, mesh)
            self._files.count_shape(len(faces))
            material = self._material(geom, pictured=False)
            return [bake_transform(make_part(vertices, faces, material=material, name=model.mesh(mesh).name), pose)]
        self._files.count_shape(sum(len(part.faces) for part in parts))
        inertia_to_mesh = transform(rotation_from_quaternion_wxyz(model.mesh_quat[mesh]), model.mesh_pos[mesh])
        to_asset = pose @ inverse(inertia_to_mesh)
        materials = {
            has_uv: self._material(geom, pictured=has_uv) for has_uv in {uv_of(part) is not None for part in parts}
        }
        return [bake_transform(_with_material(part, materials[uv_of(part) is not None]), to_asset) for part in parts]

    def _material(self, geom: int, *, pictured: bool) -> PBRMaterial:
        """Return the material of a geom; unless ``pictured``, its texture is replaced by the mean colour.

        ``pictured`` says that the shape has texture coordinates; MuJoCo projects textures onto shapes without them. If textures
        are not decoded, all of them are kept, for audits that list them.
        """
        pictured = pictured or not self._files.limits.decode_textures
        model, index = self._model, int(self._model.geom_matid[geom])
        own = index < 0 or not np.allclose(model.geom_rgba[geom], _DEFAULT_RGBA)
        rgba = np.array(model.geom_rgba[geom] if own else model.mat_rgba[index], float)
        name = None if index < 0 else model.mat(index).name
        alpha = float(np.clip(rgba[3], 0, 1))
        paint = self._compiled.paint
        if name is not None and name in paint.plain:
            rgba[:3] *= paint.plain[name]
        linear = srgb_to_linear(np.clip(rgba[:3], 0, 1))
        if name in paint.means and not pictured:
            linear = linear * paint.means[name]
            self._files.remark(
                "pictures that MuJoCo projects onto shapes without texture coordinates are shown as their mean colour"
            )
        base_color = (*linear.tolist(), alpha)
        return pbr_material(
            name,
            base_color=color_of_lost_texture(base_color) if name in paint.lost else base_color,
            base_color_texture=paint.images.get(name) if name is not None and pictured else None,
            alpha_mode="BLEND" if alpha < 1 else None,
        )


def _with_material(part: trimesh.Trimesh, material: PBRMaterial) -> trimesh.Trimesh:
    """Return the part with the material of the MJCF file, unless only the mesh file has a texture."""
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


def _mesh_arrays(model: Any, mesh: int) -> tuple[np.ndarray, np.ndarray]:
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    face, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    return np.array(model.mesh_vert[first : first + count], float), np.array(model.mesh_face[face : face + faces], int)


def _plane_sheet(size: np.ndarray) -> trimesh.Trimesh:
    """Return a sheet below a plane with half lengths ``size``, of which 0 means infinite (MJCF reference, geom type)."""
    sides = [2 * float(half) if half > 0 else _UNBOUNDED_M for half in size[:2]]
    sheet = trimesh.creation.box((*sides, _SHEET_M))
    sheet.apply_translation((0, 0, -_SHEET_M / 2))
    return sheet


def _terrain(model: Any, field: int) -> trimesh.Trimesh:
    """Return the surface of a height field: rows along y from -size[1], columns along x, heights times size[2] (MJCF, hfield)."""
    rows, columns, first = (int(a[field]) for a in (model.hfield_nrow, model.hfield_ncol, model.hfield_adr))
    half_x, half_y, height, _ = (float(size) for size in model.hfield_size[field])
    x, y = np.meshgrid(np.linspace(-half_x, half_x, columns), np.linspace(-half_y, half_y, rows))
    z = height * np.asarray(model.hfield_data[first : first + rows * columns], float)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1)
    lower = np.column_stack([corner, corner + 1, corner + columns + 1])
    upper = np.column_stack([corner, corner + columns + 1, corner + columns])
    vertices = np.column_stack([x.reshape(-1), y.reshape(-1), z])
    return trimesh.Trimesh(vertices, np.concatenate([lower, upper]), process=False)


def _primitive(kind: int, size: np.ndarray) -> trimesh.Trimesh | None:
    """Return the mesh of a primitive geom, whose sizes are half lengths (MJCF reference, geom size); None for other kinds."""
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
