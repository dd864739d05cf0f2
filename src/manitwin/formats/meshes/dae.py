"""Reader of COLLADA 1.4 meshes (.dae)."""

from __future__ import annotations

import io
import re
from functools import partial
from typing import Any

import collada
import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]
from PIL import Image
from trimesh.visual.material import PBRMaterial

from manitwin.errors import InputError
from manitwin.formats.meshes.source import MAX_PARTS, MeshSource
from manitwin.formats.meshes.textures import (
    DEFAULT_COLOR,
    bake_transform,
    color_by_corner,
    color_of_lost_texture,
    decode_texture,
    make_part,
    pbr_material,
)
from manitwin.formats.xml_file import parse_xml

_REMEDY = "export it again, or as glTF 2.0"
_MAX_BYTES = 512 << 20
_MAX_NODES = 8_000_000
_NOT_FOUND = "Geometry #"
"""pycollada's message for a node whose shape was left out before for another reason, which is more informative."""
_OF_SHAPES = re.compile(
    r"Corrupted (?!color)|Failed to parse \w+ transform|Geometry #|.*\b(?:triangles|polylist|polygons)\b"
)
"""Messages of pycollada about unreadable shapes and nodes, as opposed to materials, lights and cameras."""
_END_OF_ARCHIVE = b"PK\x05\x06"


def read_dae(source: MeshSource) -> tuple[list[trimesh.Trimesh], float | None, str | None]:
    """Read a COLLADA file: parts with node transforms applied, its unit in metres, its up axis 'x' | 'y' | 'z'.

    Unit and up axis are None for a file without <unit> or <up_axis>. Raises InputError ``unreadable``, ``animated`` (skinned
    meshes).
    """
    data = source.data()
    _check_size(data, source)
    unit_m, up, skinned = _inspect(data, source)
    if skinned:
        raise source.refused("animated", "the mesh is bound to a skeleton", "apply the pose and export a still mesh")
    try:
        data = _without_comments(data, source)
        document = _without_broken_materials(_document(data), data, source)
        with np.errstate(all="ignore"):  # overflows are found when vertices are checked
            parts = _parts(document, source)
        _remark_lost_shapes(document, parts, source)
    except collada.common.DaeError as error:
        raise source.unreadable(f"its COLLADA is broken ({str(error)[:100]})", _REMEDY) from error
    return parts, unit_m, up


def _document(data: bytes) -> Any:
    return collada.Collada(io.BytesIO(data), ignore=[collada.common.DaeError])


def _without_comments(data: bytes, source: MeshSource) -> bytes:
    """Return a document without comments: pycollada skips a mesh with a comment among its primitives."""
    if b"<!--" not in data:
        return data
    refusal = partial(InputError, "unreadable")
    root = parse_xml(data, "COLLADA", source.path.name, refusal=refusal, comments=False, max_bytes=None)
    whole: bytes = etree.tostring(root)
    return whole


def _without_broken_materials(document: Any, data: bytes, source: MeshSource) -> Any:
    """Remove references to unreadable materials, because pycollada skips shapes that have them."""
    known = {material.id for material in document.materials}
    refusal = partial(InputError, "unreadable")
    root = parse_xml(data, "COLLADA", source.path.name, refusal=refusal, comments=False, max_bytes=None)
    named = list(root.iter("{*}instance_material"))
    broken = [each for each in named if (each.get("target") or "").removeprefix("#") not in known]
    if not broken:
        return document
    for each in broken:
        each.getparent().remove(each)
    source.add_finding("materials in it are broken, and what has them is grey")
    return _document(etree.tostring(root))


def _remark_lost_shapes(document: Any, parts: list[trimesh.Trimesh], source: MeshSource) -> None:
    """Remark on shapes and nodes that pycollada skipped as broken, with the first cause; raises InputError if none are left."""
    said = [str(each).rpartition(f"{type(each).__name__}: ")[2] for each in document.errors]
    lost = sorted((each for each in said if _OF_SHAPES.match(each)), key=lambda each: each.startswith(_NOT_FOUND))
    if lost and not parts:
        cause = f"it has no readable faces because its COLLADA is broken ({lost[0][:100]})"
        raise source.refused("no_faces", cause, _REMEDY)
    if lost:
        source.add_finding(f"broken shapes or nodes in it were left out ({lost[0][:100]})")


def _check_size(data: bytes, source: MeshSource) -> None:
    """Refuse a document whose tree would need many times its size, and an embedded archive, which pycollada would open."""
    if len(data) > _MAX_BYTES or data.count(b"<") + data.count(b"=") > _MAX_NODES:
        raise source.too_large(f"more than {_MAX_BYTES >> 20} MiB or {_MAX_NODES} elements", "export it as glTF 2.0")
    if _END_OF_ARCHIVE in data:
        raise source.unreadable("it contains a ZIP archive", _REMEDY)


def _inspect(data: bytes, source: MeshSource) -> tuple[float | None, str | None, bool]:
    """Return unit, up axis and whether it is skinned; raises InputError ``unreadable``."""
    refusal = partial(InputError, "unreadable")
    root = parse_xml(data, "COLLADA", source.path.name, refusal=refusal, comments=False, max_bytes=None)
    unit_m, up = None, None
    for element in root.iterfind("./{*}asset/{*}unit"):
        try:
            unit_m = float(element.get("meter", "1"))
        except ValueError:
            source.add_finding("its <unit> is broken and was not used")
    for element in root.iterfind("./{*}asset/{*}up_axis"):
        up = {"X_UP": "x", "Y_UP": "y", "Z_UP": "z"}.get((element.text or "").strip())
    if unit_m is not None and not (np.isfinite(unit_m) and unit_m > 0):
        unit_m = None
    source.check_parts(_instances(root))
    return unit_m, up, root.find(".//{*}instance_controller") is not None


def _instances(root: etree._Element) -> int:
    """Count the nodes after expanding nested instances, without walking them: a short file can request billions."""
    nodes = {node.get("id"): node for node in root.iter("{*}node") if node.get("id")}
    counts: dict[etree._Element, int] = {}
    open_nodes: set[etree._Element] = set()

    def count(element: etree._Element) -> int:
        if element not in counts:
            if element in open_nodes:
                return MAX_PARTS + 1  # a node inside itself
            open_nodes.add(element)
            total = 1
            for child in element.iterchildren("{*}node", "{*}instance_node"):
                name = etree.QName(child).localname
                target = child if name == "node" else nodes.get((child.get("url") or "").removeprefix("#"))
                total += 0 if target is None else count(target)
            open_nodes.discard(element)
            counts[element] = min(total, MAX_PARTS + 1)
        return counts[element]

    return sum(count(scene) for scene in root.iter("{*}visual_scene"))


def _parts(document: Any, source: MeshSource) -> list[trimesh.Trimesh]:
    if document.scene is None:
        raise source.unreadable("it has no visual scene", _REMEDY)
    textures: dict[str, Image.Image | None] = {}
    materials: dict[int, PBRMaterial] = {}
    parts: list[trimesh.Trimesh] = []
    faces = 0
    for bound in document.scene.objects("geometry"):
        for primitive in bound.original.primitives:
            triangles = primitive.triangleset() if hasattr(primitive, "triangleset") else primitive
            if not isinstance(triangles, collada.triangleset.TriangleSet) or triangles.vertex_index is None:
                source.add_finding("points or lines in it were left out")
                continue
            source.check_parts(len(parts) + 1)
            faces += len(triangles.vertex_index)
            source.check_faces(faces)
            node = bound.materialnodebysymbol.get(triangles.material)
            material = node.target if node is not None else None
            if id(material) not in materials:
                materials[id(material)] = _material(material, textures, source)
            part = _part(triangles, materials[id(material)], bound.original.id, source)
            parts.append(bake_transform(part, np.asarray(bound.matrix, dtype=np.float64)))
    return parts


def _part(triangles: Any, material: PBRMaterial, name: str, source: MeshSource) -> trimesh.Trimesh:
    order = np.asarray(triangles.vertex_index, dtype=np.int64).reshape(-1)
    unused = np.zeros_like(order)
    uv = triangles.texcoordset[0] if len(triangles.texcoordset) else None
    uv_order = unused if uv is None else np.asarray(triangles.texcoord_indexset[0], dtype=np.int64).reshape(-1)
    normals = triangles.normal if triangles.normal_index is not None else None
    normal_order = unused if normals is None else np.asarray(triangles.normal_index, dtype=np.int64).reshape(-1)
    rows, inverse = np.unique(np.stack([order, uv_order, normal_order], axis=1), axis=0, return_inverse=True)
    part = make_part(
        np.asarray(triangles.vertex)[rows[:, 0]],
        inverse.reshape(-1, 3),
        material=material,
        name=name or "mesh",
        uv=None if uv is None else np.asarray(uv)[rows[:, 1], :2],
        normals=None if normals is None else np.asarray(normals)[rows[:, 2]],
    )
    colors = triangles.sources.get("COLOR")
    if not colors or material.baseColorTexture is not None:
        return part
    offset, data = colors[0][0], np.asarray(colors[0][4].data)
    by_corner = data[np.asarray(triangles.index)[:, :, offset], :3]
    return color_by_corner(part, np.round(np.clip(np.nan_to_num(by_corner), 0, 1) * 255).astype(np.uint8), source)


def _material(material: Any, textures: dict[str, Image.Image | None], source: MeshSource) -> PBRMaterial:
    effect = getattr(material, "effect", None)
    if effect is None:
        return pbr_material(base_color=DEFAULT_COLOR)
    texture: Image.Image | None = None
    color: tuple[float, ...] = (1.0, 1.0, 1.0)
    if isinstance(effect.diffuse, collada.material.Map):
        path = effect.diffuse.sampler.surface.image.path or ""
        if not path:
            source.add_finding("a material names a texture without a file; carried on without it")
            textures[path] = None
        if path not in textures:
            data = source.sibling(path.removeprefix("./"), "texture")
            textures[path] = None if data is None else decode_texture(data, path, source)
        texture = textures[path]
        color = color_of_lost_texture(color) if texture is None else color
    elif effect.diffuse is not None:
        color = tuple(float(c) for c in effect.diffuse[:3])
    shininess = effect.shininess if isinstance(effect.shininess, int | float) else 0.0
    return pbr_material(
        material.id,
        base_color=color,
        roughness=(2 / (max(float(shininess), 0.0) + 2)) ** 0.25,
        base_color_texture=texture,
    )
