"""Reader of PLY meshes (Turk 1994), ASCII and binary, with vertex or face colours or a texture."""

from __future__ import annotations

import re

import numpy as np
import trimesh
from PIL import Image

from manitwin.formats.meshes.ply_rows import (
    REMEDY,
    Columns,
    Element,
    Lists,
    Property,
    Words,
    ascii_rows,
    binary_rows,
    check_rows,
)
from manitwin.formats.meshes.shading_normals import triangle_fans
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import DEFAULT_COLOR, color_by_corner, decode_texture, make_part, pbr_material
from manitwin.formats.source_files import ply_texture

_MAX_DIGITS = 18  # more rows than any disk holds
_TYPES = {
    "char": "i1", "uchar": "u1", "int8": "i1", "uint8": "u1", "short": "i2", "ushort": "u2", "int16": "i2", "uint16":
    "u2", "int": "i4", "uint": "u4", "int32": "i4", "uint32": "u4", "float": "f4", "float32": "f4", "double": "f8",
    "float64": "f8",
}  # fmt: skip


def read_ply(source: MeshSource) -> list[trimesh.Trimesh]:
    """Read a PLY into one part; polygons of any size are cut into triangle fans.

    Raises InputError: ``unreadable`` for a truncated or broken file, ``no_faces`` for a point cloud.
    """
    data = source.data()
    encoding, elements, texture, offset = _header(data, source)
    lists = [p for e in elements if e.name == "face" for p in e.properties if p.count_dtype is not None]
    if not lists:
        points = sum(e.count for e in elements if e.name == "vertex")
        raise source.refused("no_faces", f"{points} vertices and no faces", "export the surface, not a point cloud")
    return [_part(_tables(data, encoding, elements, offset, source), texture, source)]


def read_ply_points(source: MeshSource) -> np.ndarray:
    """Return the vertices ``(N, 3) float64`` of a PLY, with or without faces; raises InputError ``unreadable``."""
    data = source.data()
    encoding, elements, _, offset = _header(data, source)
    positions = _stacked(_tables(data, encoding, elements, offset, source).get("vertex", {}), ("x", "y", "z"))
    if positions is None:
        raise source.unreadable("the PLY has no vertex positions", REMEDY)
    return positions


def _tables(data: bytes, encoding: str, elements: list[Element], offset: int, source: MeshSource) -> dict[str, Columns]:
    words = Words(data, offset)
    order = ">" if encoding == "binary_big_endian" else "<"
    tables: dict[str, Columns] = {}
    for element in elements:
        check_rows(element, len(data) - offset, source)
        if encoding == "ascii":
            tables[element.name] = ascii_rows(element, words, source)
        else:
            tables[element.name], offset = binary_rows(element, data, offset, order, source)
    return tables


def _header(data: bytes, source: MeshSource) -> tuple[str, list[Element], str | None, int]:
    end = re.search(rb"^end_header[ \t]*+\r?\n", data[: 1 << 20], re.MULTILINE)
    if end is None:
        raise source.unreadable("its PLY header has no end", REMEDY)
    encoding = ""
    elements: list[tuple[str, int, list[Property]]] = []
    for line in data[: end.start()].decode("utf-8", errors="replace").splitlines()[1:]:
        words = line.split()
        if words[:1] == ["format"] and len(words) > 1:
            encoding = words[1]
        elif words[:1] == ["element"] and len(words) == 3 and _is_count(words[2]):
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"] and elements:
            elements[-1][2].append(_property(words, source))
        elif words[:1] not in ([], ["comment"], ["obj_info"]):
            raise source.unreadable(f"a line of its PLY header is broken: {line[:60]!r}", REMEDY)
    if encoding not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise source.unreadable(f"PLY format {encoding[:30]!r} is unknown", REMEDY)
    return (
        encoding,
        [Element(name, count, tuple(properties)) for name, count, properties in elements],
        ply_texture(data[: end.start()]),
        end.end(),
    )


def _is_count(word: str) -> bool:
    return word.isascii() and word.isdigit() and len(word) <= _MAX_DIGITS


def _property(words: list[str], source: MeshSource) -> Property:
    if len(words) == 3 and words[1] in _TYPES:
        return Property(words[2], _TYPES[words[1]])
    if len(words) == 5 and words[1] == "list" and words[2] in _TYPES and words[3] in _TYPES:
        return Property(words[4], _TYPES[words[3]], _TYPES[words[2]])
    raise source.unreadable(f"a PLY property is broken: {' '.join(words)[:60]!r}", REMEDY)


def _part(tables: dict[str, Columns], texture: str | None, source: MeshSource) -> trimesh.Trimesh:
    vertex, face = tables.get("vertex", {}), tables.get("face", {})
    positions = _stacked(vertex, ("x", "y", "z"))
    if positions is None:
        raise source.unreadable("the PLY has no vertex positions", REMEDY)
    polygons = next((face[n] for n in ("vertex_indices", "vertex_index") if isinstance(face.get(n), Lists)), None)
    if not isinstance(polygons, Lists) or not (polygons.sizes >= 3).any():
        raise source.refused(
            "no_faces", f"{len(positions)} vertices and no faces", "export the surface, not a point cloud"
        )
    source.check_faces(int(np.maximum(polygons.sizes - 2, 0).sum()))
    corners, owner = triangle_fans(polygons.sizes)
    named = polygons.values[corners]
    if not ((named >= 0) & (named < len(positions))).all():  # also false for NaN
        raise source.unreadable("a face refers to a vertex that does not exist", REMEDY)
    faces = named.astype(np.int64)
    image = _texture(texture, source)
    uv = next(
        (
            s
            for names in (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
            if (s := _stacked(vertex, names)) is not None
        ),
        None,
    )
    material = pbr_material(base_color_texture=image, base_color=(1, 1, 1) if image is not None else DEFAULT_COLOR)
    wedge = face.get("texcoord")
    normals = _stacked(vertex, ("nx", "ny", "nz"))
    if image is not None and isinstance(wedge, Lists) and (wedge.sizes == 2 * polygons.sizes).all():
        flat = faces.reshape(-1)
        return make_part(
            positions[flat],
            np.arange(len(flat)).reshape(-1, 3),
            material=material,
            name="mesh",
            uv=wedge.values.reshape(-1, 2)[corners.reshape(-1)],
            normals=None if normals is None else normals[flat],
        )
    part = make_part(positions, faces, material=material, name="mesh", uv=uv, normals=normals)
    colors = _corner_colors(vertex, face, faces, owner)
    if image is not None or colors is None:
        return part
    material.baseColorFactor = np.full(4, 255, np.uint8)
    return color_by_corner(part, colors, source)


def _corner_colors(vertex: Columns, face: Columns, faces: np.ndarray, owner: np.ndarray) -> np.ndarray | None:
    """Return the colours ``(F, 3, 3) uint8`` of all corners, from their vertices or else their polygons."""
    by_vertex, by_polygon = _colors(vertex), _colors(face)
    if by_vertex is not None:
        return by_vertex[faces]
    return None if by_polygon is None else np.repeat(by_polygon[owner][:, None], 3, axis=1)


def _stacked(columns: Columns, names: tuple[str, ...]) -> np.ndarray | None:
    found = [columns.get(name) for name in names]
    if any(not isinstance(column, np.ndarray) for column in found):
        return None
    with np.errstate(invalid="ignore"):  # a signalling NaN of 32 bits becomes a quiet one
        return np.stack([np.asarray(column, dtype=np.float64) for column in found], axis=1)


def _colors(columns: Columns) -> np.ndarray | None:
    colors = _stacked(columns, ("red", "green", "blue"))
    if colors is None:
        return None
    red = columns["red"]
    # floats are 0..1 by convention, integers 0..255; ASCII rows are parsed as floats in both cases
    scale = (
        255.0 if isinstance(red, np.ndarray) and red.dtype.kind == "f" and len(colors) and colors.max() <= 1.0 else 1.0
    )
    return np.clip(np.round(np.clip(np.nan_to_num(colors), -1, 255) * scale), 0, 255).astype(np.uint8)


def _texture(name: str | None, source: MeshSource) -> Image.Image | None:
    if name is None:
        return None
    data = source.sibling(name, "texture")
    return None if data is None else decode_texture(data, name, source)
