"""Reader of FBX meshes, common in game engines and asset stores, by the Open Asset Import Library (Assimp)."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

import numpy as np
import trimesh
from trimesh.visual.material import PBRMaterial

from manitwin.formats.fbx_names import embedded_files, relative_name
from manitwin.formats.fbx_unit import fbx_unit_m
from manitwin.formats.isolated import Limits, ProcessCrashed, run_isolated
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import (
    DEFAULT_COLOR,
    bake_transform,
    color_by_corner,
    color_of_lost_texture,
    decode_texture,
    make_part,
    pbr_material,
)
from manitwin.formats.sniff import FBX_BINARY, FBX_TEXT

INSTALL = "pip install 'manitwin[fbx]'"
_LIMITS = Limits(seconds=300.0)
_OLDEST = 7100
_HEADER_BYTES = 27
"""Of a binary file: its name, two bytes, and four bytes of version."""
_REMEDY = "export it again as FBX 7.4 (2014) or glTF 2.0"
_DIFFUSE, _BASE_COLOR, _NORMALS = 1, 12, 6
"""Kinds of textures (Assimp, ``aiTextureType``)."""
_BOUND = b"Deformer"
"""Class name of FBX objects that deform vertices: skeletons and morph targets."""
_DEEPEST = 200


@dataclass(frozen=True)
class FbxMesh:
    """A placed mesh: ``vertices`` (V, 3) in its own frame, ``faces`` (F, 3), its transform (4, 4) to metres with Y up.

    ``uv`` (V, 2) has its origin at the lower left, ``colors`` (V, 4) are in 0..1; ``material`` is an index in the file.
    """

    name: str
    matrix: np.ndarray
    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None
    uv: np.ndarray | None
    colors: np.ndarray | None
    material: int


@dataclass(frozen=True)
class FbxMaterial:
    """A material: ``color`` RGB, ``opacity``, and the names of its textures as written in the file."""

    name: str
    color: tuple[float, float, float]
    opacity: float
    texture: str | None
    normal_texture: str | None


def read_fbx(source: MeshSource) -> tuple[list[trimesh.Trimesh], float, Literal["y"]]:
    """Read all meshes of an FBX file: parts in its unit, with transforms applied and Y up whatever its axes; unit in metres.

    Raises InputError ``wrong_type`` if the packages of ``manitwin[fbx]`` are not installed, ``unreadable``, ``too_large``.
    """
    if find_spec("assimp_py") is None:
        raise source.refused("wrong_type", "the FBX reader is not installed", f"{INSTALL}, or export it as glTF 2.0")
    data = source.data()
    version = _version(data)
    if version is not None and version < _OLDEST:
        raise source.unreadable(
            f"FBX {version / 1000:.1f} is not supported, only {_OLDEST / 1000:.1f} (2011) and later", _REMEDY
        )
    try:
        meshes, materials = run_isolated(f"{__name__}:scene_of", data, source.limits.max_faces, limits=_LIMITS)
    except ProcessCrashed as error:
        raise source.unreadable("its FBX is so damaged that the reader crashes or hangs", _REMEDY) from error
    except ValueError as error:
        raise source.unreadable(str(error), _REMEDY) from error
    except OverflowError as error:
        raise source.too_large(str(error)) from error
    if _BOUND in data:
        source.add_finding("it is bound to a skeleton, or has morph targets; it was taken as it was modelled")
    held = embedded_files(data)
    known = [_material(each, held, source) for each in materials]
    unit_m = fbx_unit_m(data)
    to_units = np.diag([*[1 / unit_m] * 3, 1.0])
    return [bake_transform(_part(mesh, known, source), to_units) for mesh in meshes], unit_m, "y"


def scene_of(data: bytes, max_faces: int) -> tuple[list[FbxMesh], list[FbxMaterial]]:
    """Return the meshes and materials of an FBX file's content.

    To be run in an isolated process. Raises ValueError for content that Assimp cannot read, OverflowError above ``max_faces``.
    """
    import assimp_py

    flags = (
        assimp_py.Process_Triangulate
        | assimp_py.Process_SortByPType  # separates points and lines from triangles
        | assimp_py.Process_GlobalScale  # to metres
    )
    # Assimp chooses its reader by the name, and must not find other files
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "scene.fbx"
        place.write_bytes(data)
        try:
            scene = assimp_py.import_file(str(place), flags)
        except (RuntimeError, ValueError, TypeError) as error:  # its message may belong to a previous file
            only = "its FBX is broken, or contains only points, lines and curved surfaces"
            mixed = "it holds points or lines beside its meshes, which its reader cannot leave out"
            raise ValueError(mixed if "assumes triangulated" in str(error) else only) from None
    placed: list[FbxMesh] = []
    faces = 0
    todo = [(scene.root_node, np.eye(4), 0)]
    while todo:
        node, parent, depth = todo.pop()
        if depth > _DEEPEST:
            raise ValueError(f"more than {_DEEPEST} nodes within each other")
        matrix = parent @ np.array(node.transformation, np.float64)
        for index in node.mesh_indices:
            mesh = scene.meshes[index]
            faces += mesh.num_faces
            if faces > max_faces:
                raise OverflowError(f"{faces} faces exceed the limit of {max_faces}")
            if mesh.num_indices == 3 * mesh.num_faces:
                placed.append(_mesh(mesh, str(node.name), matrix))
        todo.extend((child, matrix, depth + 1) for child in reversed(node.children))
    return placed, [_read_material(each) for each in scene.materials]


def _version(data: bytes) -> int | None:
    """Return the version, such as 7400, at the start of an FBX file; None if there is none."""
    if data.startswith(FBX_BINARY) and len(data) >= _HEADER_BYTES:
        return int.from_bytes(data[_HEADER_BYTES - 4 : _HEADER_BYTES], "little")
    said = FBX_TEXT.match(data[:100].decode("latin-1").lstrip())
    return None if said is None else 1000 * int(said[1]) + 100 * int(said[2])


def _mesh(mesh: Any, name: str, matrix: np.ndarray) -> FbxMesh:
    count = mesh.num_vertices
    uv = np.asarray(mesh.texcoords[0], np.float64).reshape(count, -1) if mesh.texcoords else None
    return FbxMesh(
        name=name or str(mesh.name),
        matrix=matrix,
        vertices=np.asarray(mesh.vertices, np.float64).reshape(count, 3),
        faces=np.asarray(mesh.indices, np.int64).reshape(-1, 3),
        normals=None if mesh.normals is None else np.asarray(mesh.normals, np.float64).reshape(count, 3),
        uv=None if uv is None or uv.shape[1] < 2 else uv[:, :2],
        colors=np.asarray(mesh.colors[0], np.float64).reshape(count, 4) if mesh.colors else None,
        material=int(mesh.material_index),
    )


def _read_material(material: dict[str, Any]) -> FbxMaterial:
    textures = material.get("TEXTURES") or {}
    named = {kind: str(names[0]) for kind, names in textures.items() if names}
    red, green, blue = (float(each) for each in (*material.get("COLOR_DIFFUSE", DEFAULT_COLOR), 0.0, 0.0)[:3])
    return FbxMaterial(
        name=str(material.get("NAME", "")),
        color=(red, green, blue),
        opacity=float(material.get("OPACITY", 1.0)),
        texture=named.get(_BASE_COLOR, named.get(_DIFFUSE)),
        normal_texture=named.get(_NORMALS),
    )


def _material(told: FbxMaterial, held: dict[str, bytes], source: MeshSource) -> PBRMaterial:
    texture, normals = (_texture(name, held, source) for name in (told.texture, told.normal_texture))
    color: tuple[float, ...] = told.color
    if told.texture is not None:
        color = (1.0, 1.0, 1.0) if texture is not None else color_of_lost_texture(told.color)
    alpha = told.opacity if 0 < told.opacity < 1 else 1.0
    return pbr_material(
        told.name or None,
        base_color=(*color, alpha),
        base_color_texture=texture,
        normal_texture=normals,
        alpha_mode="BLEND" if alpha < 1 else None,
    )


def _texture(name: str | None, held: dict[str, bytes], source: MeshSource) -> Any:
    """Return a texture that is embedded in the file or lies beside it."""
    if not name:
        return None
    data = held.get(relative_name(name).rpartition("/")[2])
    data = source.sibling(relative_name(name), "texture") if data is None else data
    return None if data is None else decode_texture(data, relative_name(name), source)


def _part(mesh: FbxMesh, materials: list[PBRMaterial], source: MeshSource) -> trimesh.Trimesh:
    known = 0 <= mesh.material < len(materials)
    material = materials[mesh.material] if known else pbr_material(base_color=DEFAULT_COLOR)
    part = make_part(mesh.vertices, mesh.faces, material=material, name=mesh.name, uv=mesh.uv, normals=mesh.normals)
    if mesh.colors is not None and material.baseColorTexture is None:
        shown = np.round(np.clip(np.nan_to_num(mesh.colors[:, :3]), 0, 1) * 255).astype(np.uint8)
        part = color_by_corner(part, shown[mesh.faces], source)
    return bake_transform(part, mesh.matrix)
