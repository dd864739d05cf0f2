"""Meshes of glTF 2.0 documents, as .glb and as .gltf with files beside it."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation
from trimesh.visual import TextureVisuals

from manitwin.errors import InputError
from manitwin.formats.bounded_file import decode_text
from manitwin.formats.json_file import parse_json
from manitwin.formats.meshes.gltf_document import Accessors, split_glb
from manitwin.formats.meshes.gltf_draco import DRACO, decompress
from manitwin.formats.meshes.gltf_materials import GltfMaterials, texture_coordinates, transformed_uv
from manitwin.formats.meshes.gltf_meshopt import MESHOPT
from manitwin.formats.meshes.gltf_morph import morphed, target_weights
from manitwin.formats.meshes.gltf_skin import influences, joint_matrices, posed
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import (
    bake_transform,
    color_by_corner,
    linear_to_srgb,
    make_part,
    material_of,
    uv_of,
    without_unused_vertices,
)

# required extensions that change nothing of the geometry, or that are understood here
_KNOWN_REQUIRED = (
    "KHR_texture_",
    "KHR_materials_",
    "KHR_mesh_quantization",
    DRACO,
    MESHOPT,
    "KHR_lights_punctual",
    "EXT_texture_webp",
    "KHR_xmp",
)
_INSTANCING = "EXT_mesh_gpu_instancing"
_NAME_CHARACTERS = 200
_WHITE = 1 - 1 / 255


def read_gltf(source: MeshSource, binary: bool, *, data: bytes | None = None) -> list[trimesh.Trimesh]:
    """Read the default scene of a glTF 2.0 document into parts in its own frame (metres, Y-up), node transforms baked.

    ``data`` is the document itself where it is not the file's. A mesh that is bound to a skeleton is taken in the pose that the
    file holds. Raises InputError: ``unreadable``, ``too_large``.
    """
    with source.reading("glTF"):
        return _scene_parts(source, binary, source.data() if data is None else data)


def _scene_parts(source: MeshSource, binary: bool, data: bytes) -> list[trimesh.Trimesh]:
    text, chunk = split_glb(data, source) if binary else (data, None)
    tree = _parse(text, source)
    _check_document(tree, source)
    accessors = Accessors(tree, chunk, source)
    materials = GltfMaterials(tree, accessors, source)
    reader = _Primitives(tree, accessors, materials, source)
    parts: list[trimesh.Trimesh] = []
    faces = vertices = 0
    placed = _placed_nodes(tree, source)
    for number, matrix in placed.items():
        node = tree["nodes"][number]
        if "mesh" not in node:
            continue
        if _INSTANCING in (node.get("extensions") or {}):
            source.find(f"instances of a mesh in it ({_INSTANCING}) were left out: it was taken once")
        weights = target_weights(node.get("weights"), source)
        if "skin" in node:
            source.find("it is bound to a skeleton; it was taken in the pose that the file holds")
            joints = joint_matrices(tree, node["skin"], placed, accessors, source)
            found = reader.posed_parts(node["mesh"], joints, weights)
            matrix = np.eye(4)  # its own node does not move it
        elif weights:
            found = reader.posed_parts(node["mesh"], None, weights)
        else:
            found = reader.parts(node["mesh"])
        for part in found:
            faces += len(part.faces)
            source.check_faces(faces)
            if vertices + len(part.vertices) > source.limits.max_vertices:
                part = without_unused_vertices(part)
            vertices += len(part.vertices)
            source.check_parts(len(parts) + 1)
            parts.append(bake_transform(part, matrix))
    return parts


def _parse(text: bytes, source: MeshSource) -> dict[str, Any]:
    refuse = partial(InputError, "unreadable")
    tree = parse_json(decode_text(text, source.name, refuse).rstrip("\0 "), source.name, refuse)
    if not isinstance(tree, dict) or not isinstance(tree.get("asset"), dict):
        raise source.unreadable("its JSON is no glTF document", "export it as glTF 2.0")
    return tree


def _check_document(tree: dict[str, Any], source: MeshSource) -> None:
    version = str(tree["asset"].get("version", ""))
    if not version.startswith("2"):
        raise source.unreadable(f"glTF version {version[:10]!r}, only 2 is read", "export it as glTF 2.0")
    for table in (
        "accessors",
        "bufferViews",
        "buffers",
        "meshes",
        "nodes",
        "scenes",
        "materials",
        "textures",
        "images",
    ):
        if not isinstance(tree.get(table, []), list) or not all(
            isinstance(entry, dict) for entry in tree.get(table, [])
        ):
            raise source.unreadable(f"{table!r} is no list of objects", "export it again as glTF 2.0")
    unknown = [str(e) for e in tree.get("extensionsRequired", []) if not str(e).startswith(_KNOWN_REQUIRED)]
    if unknown:
        raise source.unreadable(
            f"it requires {', '.join(unknown)[:120]}", "export it without compression or extensions"
        )
    if tree.get("animations"):
        source.find("the file is animated; its rest pose was taken")


def _placed_nodes(tree: dict[str, Any], source: MeshSource) -> dict[int, np.ndarray]:
    """Return the transform ``(4, 4)`` to the scene of every node of the default scene, each after those that hold it."""
    nodes = tree.get("nodes", [])
    scenes = tree.get("scenes", [])
    default = tree.get("scene", 0)
    if scenes and isinstance(default, int) and 0 <= default < len(scenes):
        roots = list(scenes[default].get("nodes", []))
    else:
        children = {child for node in nodes for child in node.get("children", [])}
        roots = [index for index in range(len(nodes)) if index not in children]
    stack = [(root, np.eye(4)) for root in reversed(roots)]
    placed: dict[int, np.ndarray] = {}
    while stack:
        index, parent = stack.pop()
        if not isinstance(index, int) or not 0 <= index < len(nodes) or index in placed:
            # section 3.5.2: nodes form strict trees; anything else would never end
            raise source.unreadable("its nodes form no tree", "export it again")
        node = nodes[index]
        with np.errstate(all="ignore"):  # what overflows is found where vertices are checked
            matrix = parent @ _local_matrix(node, source)
        placed[index] = matrix
        stack.extend((child, matrix) for child in reversed(node.get("children", [])))
    return placed


def _local_matrix(node: dict[str, Any], source: MeshSource) -> np.ndarray:
    try:
        if "matrix" in node:
            return np.asarray(node["matrix"], dtype=np.float64).reshape(4, 4).T
        matrix = np.eye(4)
        rotation = Rotation.from_quat(np.asarray(node.get("rotation", (0, 0, 0, 1)), dtype=np.float64)).as_matrix()
        matrix[:3, :3] = rotation * np.asarray(node.get("scale", (1, 1, 1)), dtype=np.float64).reshape(3)
        matrix[:3, 3] = np.asarray(node.get("translation", (0, 0, 0)), dtype=np.float64).reshape(3)
        return matrix
    except (ValueError, TypeError, OverflowError) as error:
        raise source.unreadable("a node's transform is broken", "export it again") from error


class _Primitives:
    """The parts of a mesh by its index, built once for all of its instances."""

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
        """Return the parts of a mesh in the scene as ``joints`` (J, 4, 4) move it, or in its own frame without.

        ``weights`` are those of its morph targets where the node has any, its own without.
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
            self._source.find("points or lines in it were left out")
            return None
        targets = primitive.get("targets")
        if targets:
            how = "they were taken as the file weighs them" if any(weights) else "its base shape was taken"
            self._source.find(f"it has morph targets; {how}")
        attributes = primitive.get("attributes", {})
        if decompress(primitive, self._accessors, self._source):
            mode = 4
        vertices = self._rows(attributes, "POSITION", 3)
        if vertices is None:
            raise self._source.unreadable("a mesh has no positions", "export it again")
        count = len(vertices)
        if targets and any(weights):
            vertices = morphed(vertices, targets, weights, self._accessors, self._source)
        faces = self._faces(primitive, count, mode)
        used: np.ndarray | slice = slice(None)
        if self._vertex_count + count > self._source.limits.max_vertices:
            # primitives may share one array of vertices, of which each uses a few
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
            with np.errstate(invalid="ignore"):  # signalling NaNs, which make_part takes for 0
                uv = transformed_uv(uv[used].astype(np.float64), info)
            uv = np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])  # to the origin at the lower left
        normals = self._rows(attributes, "NORMAL", 3, count)
        if normals is not None and targets and any(weights):
            normals = morphed(normals, targets, weights, self._accessors, self._source, "NORMAL")
            normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        normals = None if normals is None else normals[used]
        if joints is not None:
            bound, shares = influences(attributes, self._accessors, count, self._source)
            vertices, normals = posed(vertices, normals, (bound[used], shares[used]), joints, self._source)
        part = make_part(vertices, faces, material=material, name=name, uv=uv, normals=normals)
        colors = self._rows(attributes, "COLOR_0", 3, count)
        if colors is None:
            return part
        if material.baseColorTexture is not None:
            return self._tinted(part, _linear_colors(colors[used]))
        return color_by_corner(part, _srgb_colors(colors[used])[part.faces], self._source)

    def _tinted(self, part: trimesh.Trimesh, colors: np.ndarray) -> trimesh.Trimesh:
        """Return a textured part under vertex colours ``(V, 3)``, linear, which multiply its texture (section 3.9.2).

        One colour for all of it tints its material; others would need a texture of their own.
        """
        if not len(colors) or (colors > _WHITE).all():
            return part
        if np.ptp(colors, axis=0).max() > 1 - _WHITE:
            self._source.find("colours of its vertices, which tint a texture, were left out")
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
                raise self._source.unreadable("its indices are no unsigned integers", "export it again")
            order = indices.astype(np.int64)
        if len(order) and int(order.max()) >= count:
            raise self._source.unreadable("a face names a vertex that is not there", "export it again")
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
    """Return the colours ``(V, 3)`` in 0..1 that COLOR_0 says: linear, where textures are sRGB (section 3.7.2.1)."""
    if colors.dtype.kind in "iu":  # integers that do not say normalized are meant so all the same
        colors = colors / np.iinfo(colors.dtype).max
    return np.clip(np.nan_to_num(colors.astype(np.float64)), 0, 1)


def _srgb_colors(colors: np.ndarray) -> np.ndarray:
    """Return the colours ``(V, 3) uint8`` sRGB that COLOR_0 says."""
    return np.round(linear_to_srgb(_linear_colors(colors)) * 255).astype(np.uint8)
