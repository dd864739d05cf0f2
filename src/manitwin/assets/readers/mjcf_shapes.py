"""The geoms of MuJoCo bodies as visual parts and collision shapes."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import trimesh
from trimesh.visual.material import PBRMaterial

from manitwin.assets import primitives
from manitwin.assets.asset import CollisionShape
from manitwin.assets.asset_files import AssetFiles, joined
from manitwin.assets.readers.mjcf_spec import CompiledMjcf
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

_SHOWN_GROUPS = 3  # MuJoCo's viewer shows groups 0 to 2 (mjvOption.geomgroup)
_KINDS = mujoco.mjtGeom
_MESH_KINDS = (int(_KINDS.mjGEOM_MESH), int(_KINDS.mjGEOM_SDF))


class BodyShapes:
    """Reads the geoms of one compiled file."""

    def __init__(self, compiled: CompiledMjcf, files: AssetFiles):
        self._compiled, self._model, self._files = compiled, compiled.model, files

    def of(
        self, bodies: list[tuple[int, np.ndarray]]
    ) -> tuple[tuple[trimesh.Trimesh, ...], tuple[CollisionShape, ...]]:
        """Return the visual parts and the collision shapes of bodies with their poses.

        A geom collides where contype or conaffinity is not zero. Visual are the others in a group that the viewer shows;
        where there are none, the colliding ones in such a group.
        """
        colliding = set(self.colliding(bodies))
        visual: dict[bool, list[trimesh.Trimesh]] = {True: [], False: []}
        collision = []
        for geom, body_to_asset in self._geoms(bodies):
            parts = self._parts(geom, body_to_asset)
            if geom in colliding and parts:
                vertices, faces = joined(parts)
                name = self._model.geom(geom).name or f"geom_{geom:02d}"
                collision.append(CollisionShape(name, vertices, faces, convex=True))
            if self._model.geom_group[geom] < _SHOWN_GROUPS:
                visual[geom in colliding] += parts
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
        solid = _primitive(int(model.geom_type[geom]), np.array(model.geom_size[geom]))
        if solid is None:
            self._files.remark("planes and height fields were left out: they are no objects")
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


def _primitive(kind: int, size: np.ndarray) -> trimesh.Trimesh | None:
    """Return a geom's mesh: sizes are half lengths (MJCF reference, geom size)."""
    if kind == int(_KINDS.mjGEOM_BOX):
        return primitives.box(2 * size)
    if kind == int(_KINDS.mjGEOM_SPHERE):
        return primitives.sphere(float(size[0]))
    if kind == int(_KINDS.mjGEOM_CYLINDER):
        return primitives.cylinder(float(size[0]), 2 * float(size[1]))
    if kind == int(_KINDS.mjGEOM_CAPSULE):
        return primitives.capsule(float(size[0]), 2 * float(size[1]))
    if kind == int(_KINDS.mjGEOM_ELLIPSOID):
        return primitives.ellipsoid(size)
    return None
