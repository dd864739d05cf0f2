"""Reader of glTF 2.0 meshes, as .glb and as .gltf with side files."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.errors import InputError
from manitwin.formats.bounded_file import decode_text
from manitwin.formats.json_file import parse_json
from manitwin.formats.meshes.gltf_document import Accessors, split_glb
from manitwin.formats.meshes.gltf_draco import DRACO
from manitwin.formats.meshes.gltf_materials import GltfMaterials
from manitwin.formats.meshes.gltf_meshopt import MESHOPT
from manitwin.formats.meshes.gltf_morph import target_weights
from manitwin.formats.meshes.gltf_primitives import GltfPrimitives
from manitwin.formats.meshes.gltf_skin import joint_matrices
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import (
    bake_transform,
    without_unused_vertices,
)

# required extensions that do not affect geometry, or are supported here
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


def read_gltf(source: MeshSource, binary: bool, *, data: bytes | None = None) -> list[trimesh.Trimesh]:
    """Read the default scene of a glTF 2.0 document into parts in its own frame (metres, Y-up), with node transforms applied.

    ``data`` is the document if it is not the content of the file. A skinned mesh is read in the pose of the file. Raises
    InputError: ``unreadable``, ``too_large``.
    """
    with source.convert_errors("glTF"):
        return _scene_parts(source, binary, source.data() if data is None else data)


def _scene_parts(source: MeshSource, binary: bool, data: bytes) -> list[trimesh.Trimesh]:
    text, chunk = split_glb(data, source) if binary else (data, None)
    tree = _parse(text, source)
    _check_document(tree, source)
    accessors = Accessors(tree, chunk, source)
    materials = GltfMaterials(tree, accessors, source)
    reader = GltfPrimitives(tree, accessors, materials, source)
    parts: list[trimesh.Trimesh] = []
    faces = vertices = 0
    placed = _placed_nodes(tree, source)
    for number, matrix in placed.items():
        node = tree["nodes"][number]
        if "mesh" not in node:
            continue
        if _INSTANCING in (node.get("extensions") or {}):
            source.add_finding(f"instances of a mesh in it ({_INSTANCING}) were left out: it was taken once")
        weights = target_weights(node.get("weights"), source)
        if "skin" in node:
            source.add_finding("it is bound to a skeleton; it was taken in the pose that the file holds")
            joints = joint_matrices(tree, node["skin"], placed, accessors, source)
            found = reader.posed_parts(node["mesh"], joints, weights)
            matrix = np.eye(4)  # the transform of its own node does not apply
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
        raise source.unreadable("its JSON is not a glTF document", "export it as glTF 2.0")
    return tree


def _check_document(tree: dict[str, Any], source: MeshSource) -> None:
    version = str(tree["asset"].get("version", ""))
    if not version.startswith("2"):
        raise source.unreadable(f"glTF version {version[:10]!r}, only version 2 is supported", "export it as glTF 2.0")
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
            raise source.unreadable(f"{table!r} is not a list of objects", "export it again as glTF 2.0")
    unknown = [str(e) for e in tree.get("extensionsRequired", []) if not str(e).startswith(_KNOWN_REQUIRED)]
    if unknown:
        raise source.unreadable(
            f"it requires {', '.join(unknown)[:120]}", "export it without compression or extensions"
        )
    if tree.get("animations"):
        source.add_finding("the file is animated; its rest pose was taken")


def _placed_nodes(tree: dict[str, Any], source: MeshSource) -> dict[int, np.ndarray]:
    """Return the transform ``(4, 4)`` to the scene of every node of the default scene, parents first."""
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
            # section 3.5.2: nodes form strict trees; a cycle would never end
            raise source.unreadable("its nodes do not form a tree", "export it again")
        node = nodes[index]
        with np.errstate(all="ignore"):  # overflows are found when vertices are checked
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
