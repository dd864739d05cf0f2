"""Construction of parts from the primitives of glTF 2.0 meshes: positions, faces, colours, materials, poses."""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh
from trimesh.visual import TextureVisuals

from manitwin.formats.meshes.gltf_document import Accessors
from manitwin.formats.meshes.gltf_draco import decompress
from manitwin.formats.meshes.gltf_materials import GltfMaterials, texture_coordinates, transformed_uv
from manitwin.formats.meshes.gltf_morph import apply_morph_targets, target_weights
from manitwin.formats.meshes.gltf_skin import apply_skin, influences
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import (
    color_by_corner,
    linear_to_srgb,
    make_part,
    material_of,
    uv_of,
)

_NAME_CHARACTERS = 200
_WHITE = 1 - 1 / 255


class GltfPrimitives:
    """Builds the parts of meshes by mesh index; unposed parts are built once for all instances of a mesh."""

    def __init__(self, tree: dict[str, Any], accessors: Accessors, materials: GltfMaterials, source: MeshSource):
        self._tree, self._accessors, self._materials, self._source = tree, accessors, materials, source
        self._parts: dict[int, list[trimesh.Trimesh]] = {}
        self._primitives = self._face_count = self._vertex_count = 0

    def parts(self, index: Any) -> list[trimesh.Trimesh]:
        """Return the parts of a mesh in its own frame."""
        if index not in self._parts:
            self._parts[index] = self.posed_parts(index, None, ())
        return self._parts[index]

    def posed_parts(self, index: Any, joints: np.ndarray | None, weights: tuple[float, ...]) -> list[trimesh.Trimesh]:
        """Return the parts of a mesh, in the scene if posed by ``joints`` (J, 4, 4), otherwise in its own frame.

        ``weights`` are the morph target weights of the node; if empty, those of the mesh are used.
        """
        meshes = self._tree.get("meshes", [])
        if not isinstance(index, int) or not 0 <= index < len(meshes):
            raise self._source.unreadable(f"a node names mesh {str(index)[:20]}, which is not there", "export it again")
        name = str(meshes[index].get("name") or f"mesh_{index}")[:_NAME_CHARACTERS]
        weights = weights or target_weights(meshes[index].get("weights"), self._source)
        built = [self._part(primitive, name, joints, weights) for primitive in meshes[index].get("primitives", [])]
        return [part for part in built if part is not None]

    def _part(
        self, primitive: dict[str, Any], name: str, joints: np.ndarray | None, weights: tuple[float, ...]
    ) -> trimesh.Trimesh | None:
        mode = primitive.get("mode", 4)
        if mode not in (4, 5, 6):
            self._source.add_finding("points or lines in it were left out")
            return None
        targets = primitive.get("targets")
        if targets:
            how = "they were taken as the file weighs them" if any(weights) else "its base shape was taken"
            self._source.add_finding(f"it has morph targets; {how}")
        attributes = primitive.get("attributes", {})
        if decompress(primitive, self._accessors, self._source):
            mode = 4
        vertices = self._rows(attributes, "POSITION", 3)
        if vertices is None:
            raise self._source.unreadable("a mesh has no positions", "export it again")
        count = len(vertices)
        if targets and any(weights):
            vertices = apply_morph_targets(vertices, targets, weights, self._accessors, self._source)
        faces = self._faces(primitive, count, mode)
        used: np.ndarray | slice = slice(None)
        if self._vertex_count + count > self._source.limits.max_vertices:
            # primitives may share one vertex array, of which each uses a few
            used, inverse = np.unique(faces, return_inverse=True)
            faces = inverse.reshape(-1, 3)
        vertices = vertices[used]
        self._primitives, self._face_count = self._primitives + 1, self._face_count + len(faces)
        self._vertex_count += len(vertices)
        self._source.check_parts(self._primitives)
        self._source.check_faces(self._face_count)
        info = self._materials.base_texture(primitive.get("material"))
        material = self._materials.material(primitive.get("material"))
        uv = self._rows(attributes, f"TEXCOORD_{texture_coordinates(info)}", 2, count)
        if uv is not None:
            with np.errstate(invalid="ignore"):  # signalling NaNs, which make_part replaces by 0
                uv = transformed_uv(uv[used].astype(np.float64), info)
            uv = np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])  # to the origin at the lower left
        normals = self._rows(attributes, "NORMAL", 3, count)
        if normals is not None and targets and any(weights):
            normals = apply_morph_targets(normals, targets, weights, self._accessors, self._source, "NORMAL")
            normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        normals = None if normals is None else normals[used]
        if joints is not None:
            bound, shares = influences(attributes, self._accessors, count, self._source)
            vertices, normals = apply_skin(vertices, normals, (bound[used], shares[used]), joints, self._source)
        part = make_part(vertices, faces, material=material, name=name, uv=uv, normals=normals)
        colors = self._rows(attributes, "COLOR_0", 3, count)
        if colors is None:
            return part
        if material.baseColorTexture is not None:
            return self._tinted(part, _linear_colors(colors[used]))
        return color_by_corner(part, _srgb_colors(colors[used])[part.faces], self._source)

    def _tinted(self, part: trimesh.Trimesh, colors: np.ndarray) -> trimesh.Trimesh:
        """Return a textured part tinted by linear vertex colours ``(V, 3)``, which multiply its texture (section 3.9.2).

        A uniform colour tints the material; varying colours would need a texture of their own and are left out.
        """
        if not len(colors) or (colors > _WHITE).all():
            return part
        if np.ptp(colors, axis=0).max() > 1 - _WHITE:
            self._source.add_finding("colours of its vertices, which tint a texture, were left out")
            return part
        material = material_of(part).copy()
        factor = np.asarray(material.baseColorFactor, float) * np.append(colors.mean(axis=0), 1.0)
        material.baseColorFactor = np.round(factor).astype(np.uint8)
        part.visual = TextureVisuals(uv=uv_of(part), material=material)
        return part

    def _faces(self, primitive: dict[str, Any], count: int, mode: int) -> np.ndarray:
        order = np.arange(count)
        if "indices" in primitive:
            indices = self._accessors.array(primitive["indices"])[:, 0]
            if indices.dtype.kind != "u":  # section 3.7.2.1
                raise self._source.unreadable("its indices are not unsigned integers", "export it again")
            order = indices.astype(np.int64)
        if len(order) and int(order.max()) >= count:
            raise self._source.unreadable("a face refers to a vertex that does not exist", "export it again")
        if mode == 4:
            faces = order[: len(order) // 3 * 3].reshape(-1, 3)
        elif mode == 5:
            faces = (
                np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
                if len(order) >= 3
                else np.empty((0, 3), np.int64)
            )
            faces[1::2] = faces[1::2, [1, 0, 2]]
        else:
            faces = (
                np.stack([order[1:-1], order[2:], np.full(max(len(order) - 2, 0), order[0])], axis=1)
                if len(order) >= 3
                else order[:0].reshape(0, 3)
            )
        self._source.check_faces(len(faces))
        return faces

    def _rows(self, attributes: dict[str, Any], name: str, columns: int, count: int | None = None) -> np.ndarray | None:
        if name not in attributes:
            return None
        rows = self._accessors.array(attributes[name])
        if rows.shape[1] < columns or (count is not None and len(rows) != count):
            raise self._source.unreadable(f"{name} does not fit the mesh", "export it again")
        return rows[:, :columns]


def _linear_colors(colors: np.ndarray) -> np.ndarray:
    """Return the colours ``(V, 3)`` in 0..1 of COLOR_0, which are linear, unlike textures in sRGB (section 3.7.2.1)."""
    if colors.dtype.kind in "iu":  # integers without the normalized flag are meant as normalized too
        colors = colors / np.iinfo(colors.dtype).max
    return np.clip(np.nan_to_num(colors.astype(np.float64)), 0, 1)


def _srgb_colors(colors: np.ndarray) -> np.ndarray:
    """Return the colours ``(V, 3) uint8`` of COLOR_0 in sRGB."""
    return np.round(linear_to_srgb(_linear_colors(colors)) * 255).astype(np.uint8)
