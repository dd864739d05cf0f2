"""PLY meshes (Turk 1994), ASCII and binary, with vertex or face colours or a texture."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import trimesh
from PIL import Image

from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import color_by_corner, decode_texture, make_part, pbr_material
from manitwin.formats.meshes.triangles import triangle_fans
from manitwin.formats.source_files import ply_texture

_REMEDY = "download or export it again"
_TYPES = {
    "char": "i1", "uchar": "u1", "int8": "i1", "uint8": "u1", "short": "i2", "ushort": "u2", "int16": "i2", "uint16":
    "u2", "int": "i4", "uint": "u4", "int32": "i4", "uint32": "u4", "float": "f4", "float32": "f4", "double": "f8",
    "float64": "f8",
}  # fmt: skip
_Columns = dict[str, "np.ndarray | _Lists"]


@dataclass(frozen=True)
class _Property:
    name: str
    dtype: str
    count_dtype: str | None = None


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]


@dataclass(frozen=True)
class _Lists:
    """A list property of all rows: ``sizes (N,)`` and their ``values`` one after another."""

    sizes: np.ndarray
    values: np.ndarray


def read_ply(source: MeshSource) -> list[trimesh.Trimesh]:
    """Read a PLY into one part; polygons of any size are cut into fans of triangles.

    Raises InputError: ``unreadable`` where the file is cut short or broken, ``no_faces`` for a point cloud.
    """
    data = source.data()
    encoding, elements, texture, offset = _header(data, source)
    words = data[offset:].split() if encoding == "ascii" else []
    order = ">" if encoding == "binary_big_endian" else "<"
    tables: dict[str, _Columns] = {}
    for element in elements:
        if encoding == "ascii":
            tables[element.name], used = _ascii_rows(element, words, source)
            words = words[used:]
        else:
            tables[element.name], offset = _binary_rows(element, data, offset, order, source)
    return [_part(tables, texture, source)]


def _header(data: bytes, source: MeshSource) -> tuple[str, list[_Element], str | None, int]:
    end = re.search(rb"^end_header[ \t]*\r?\n", data[: 1 << 20], re.MULTILINE)
    if end is None:
        raise source.unreadable("its PLY header does not end", _REMEDY)
    encoding = ""
    elements: list[tuple[str, int, list[_Property]]] = []
    for line in data[: end.start()].decode("utf-8", errors="replace").splitlines()[1:]:
        words = line.split()
        if words[:1] == ["format"] and len(words) > 1:
            encoding = words[1]
        elif words[:1] == ["element"] and len(words) == 3 and words[2].isdigit():
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"] and elements:
            elements[-1][2].append(_property(words, source))
        elif words[:1] not in ([], ["comment"], ["obj_info"]):
            raise source.unreadable(f"a line of its PLY header is broken: {line[:60]!r}", _REMEDY)
    if encoding not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise source.unreadable(f"PLY format {encoding[:30]!r} is unknown", _REMEDY)
    for name, count, properties in elements:
        # every row takes at least a byte, so no header can ask for more memory than its file has
        if count > len(data) - end.end() and properties:
            raise source.unreadable(
                f"truncated: it says {count} {name} rows and has {len(data) - end.end()} bytes", _REMEDY
            )
    return (
        encoding,
        [_Element(name, count, tuple(properties)) for name, count, properties in elements],
        ply_texture(data[: end.start()]),
        end.end(),
    )


def _property(words: list[str], source: MeshSource) -> _Property:
    if len(words) == 3 and words[1] in _TYPES:
        return _Property(words[2], _TYPES[words[1]])
    if len(words) == 5 and words[1] == "list" and words[2] in _TYPES and words[3] in _TYPES:
        return _Property(words[4], _TYPES[words[3]], _TYPES[words[2]])
    raise source.unreadable(f"a PLY property is broken: {' '.join(words)[:60]!r}", _REMEDY)


def _ascii_rows(element: _Element, words: list[bytes], source: MeshSource) -> tuple[_Columns, int]:
    try:
        if all(p.count_dtype is None for p in element.properties):
            used = element.count * len(element.properties)
            table = np.array(words[:used], dtype=np.float64).reshape(element.count, len(element.properties))
            return {p.name: table[:, i] for i, p in enumerate(element.properties)}, used
        collected: dict[str, list[bytes]] = {p.name: [] for p in element.properties}
        sizes: dict[str, list[int]] = {p.name: [] for p in element.properties}
        at = 0
        for _ in range(element.count):
            for p in element.properties:
                size = 1 if p.count_dtype is None else int(words[at])
                at += p.count_dtype is not None
                if size < 0 or at + size > len(words):
                    raise ValueError(size)
                collected[p.name] += words[at : at + size]
                sizes[p.name].append(size)
                at += size
    except (ValueError, IndexError) as error:
        raise source.unreadable(
            f"truncated or broken: its {element.name} rows do not match its header", _REMEDY
        ) from error
    columns: _Columns = {}
    for p in element.properties:
        values = np.array(collected[p.name], dtype=np.float64)
        columns[p.name] = values if p.count_dtype is None else _Lists(np.array(sizes[p.name], dtype=np.int64), values)
    return columns, at


def _binary_rows(element: _Element, data: bytes, offset: int, order: str, source: MeshSource) -> tuple[_Columns, int]:
    """Read the rows as if all lists were as long as the first row's, else one by one."""
    fields: list[tuple[str, str] | tuple[str, str, tuple[int, ...]]] = []
    at = offset
    short = source.unreadable(f"truncated: its {element.name} rows end early", _REMEDY)
    if element.count == 0 or not element.properties:
        return {
            p.name: np.empty(0) if p.count_dtype is None else _Lists(np.empty(0, np.int64), np.empty(0))
            for p in element.properties
        }, at
    for i, p in enumerate(element.properties):
        size = 1
        if p.count_dtype is not None:
            counted = np.dtype(order + p.count_dtype)
            if at + counted.itemsize > len(data):
                raise short
            size = int(np.frombuffer(data, counted, 1, at)[0])
            fields.append((f"n{i}", order + p.count_dtype))
            at += counted.itemsize
        at += size * np.dtype(p.dtype).itemsize
        if size < 0 or at > len(data):
            raise short
        fields.append((f"p{i}", order + p.dtype, (size,)))
    row = np.dtype(fields)
    if offset + element.count * row.itemsize <= len(data):
        rows = np.frombuffer(data, row, element.count, offset)
        lists = [i for i, p in enumerate(element.properties) if p.count_dtype is not None]
        if all((rows[f"n{i}"] == rows[f"n{i}"][0]).all() for i in lists):
            columns: _Columns = {}
            for i, p in enumerate(element.properties):
                values = rows[f"p{i}"]
                columns[p.name] = (
                    _Lists(rows[f"n{i}"].astype(np.int64), values.reshape(-1)) if i in lists else values[:, 0]
                )
            return columns, offset + element.count * row.itemsize
    return _binary_lists(element, data, offset, order, short)


def _binary_lists(element: _Element, data: bytes, offset: int, order: str, short: Exception) -> tuple[_Columns, int]:
    collected: dict[str, list[np.ndarray]] = {p.name: [] for p in element.properties}
    at = offset
    for _ in range(element.count):
        for p in element.properties:
            size = 1
            try:
                if p.count_dtype is not None:
                    counted = np.dtype(order + p.count_dtype)
                    size = int(np.frombuffer(data, counted, 1, at)[0])
                    at += counted.itemsize
                if size < 0:
                    raise short
                collected[p.name].append(np.frombuffer(data, order + p.dtype, size, at) if size else np.empty(0))
            except ValueError as error:
                raise short from error
            at += size * np.dtype(p.dtype).itemsize
    columns: _Columns = {}
    for p in element.properties:
        values = np.concatenate(collected[p.name])
        sizes = np.array([len(v) for v in collected[p.name]], dtype=np.int64)
        columns[p.name] = values if p.count_dtype is None else _Lists(sizes, values)
    return columns, at


def _part(tables: dict[str, _Columns], texture: str | None, source: MeshSource) -> trimesh.Trimesh:
    vertex, face = tables.get("vertex", {}), tables.get("face", {})
    positions = _stacked(vertex, ("x", "y", "z"))
    if positions is None:
        raise source.unreadable("the PLY has no vertex positions", _REMEDY)
    polygons = next((face[n] for n in ("vertex_indices", "vertex_index") if isinstance(face.get(n), _Lists)), None)
    if not isinstance(polygons, _Lists) or not (polygons.sizes >= 3).any():
        raise source.refused(
            "no_faces", f"{len(positions)} vertices and no faces", "export the surface, not a point cloud"
        )
    corners, owner = triangle_fans(polygons.sizes)
    faces = polygons.values.astype(np.int64)[corners]
    source.check_faces(len(faces))
    if faces.min() < 0 or faces.max() >= len(positions):
        raise source.unreadable("a face names a vertex that is not there", _REMEDY)
    image = _texture(texture, source)
    uv = next(
        (
            s
            for names in (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
            if (s := _stacked(vertex, names)) is not None
        ),
        None,
    )
    material = pbr_material(base_color_texture=image, base_color=(1, 1, 1) if image is not None else (0.8, 0.8, 0.8))
    wedge = face.get("texcoord")
    normals = _stacked(vertex, ("nx", "ny", "nz"))
    if image is not None and isinstance(wedge, _Lists) and (wedge.sizes == 2 * polygons.sizes).all():
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


def _corner_colors(vertex: _Columns, face: _Columns, faces: np.ndarray, owner: np.ndarray) -> np.ndarray | None:
    """Return the colours ``(F, 3, 3) uint8`` of all corners, from their vertices or else their polygons."""
    by_vertex, by_polygon = _colors(vertex), _colors(face)
    if by_vertex is not None:
        return by_vertex[faces]
    return None if by_polygon is None else np.repeat(by_polygon[owner][:, None], 3, axis=1)


def _stacked(columns: _Columns, names: tuple[str, ...]) -> np.ndarray | None:
    found = [columns.get(name) for name in names]
    if any(not isinstance(column, np.ndarray) for column in found):
        return None
    return np.stack([np.asarray(column, dtype=np.float64) for column in found], axis=1)


def _colors(columns: _Columns) -> np.ndarray | None:
    colors = _stacked(columns, ("red", "green", "blue"))
    if colors is None:
        return None
    red = columns["red"]
    # floats are 0..1 by custom, integers 0..255; ASCII rows arrive as floats either way
    scale = (
        255.0 if isinstance(red, np.ndarray) and red.dtype.kind == "f" and len(colors) and colors.max() <= 1.0 else 1.0
    )
    return np.clip(np.round(np.nan_to_num(colors) * scale), 0, 255).astype(np.uint8)


def _texture(name: str | None, source: MeshSource) -> Image.Image | None:
    if name is None:
        return None
    data = source.sibling(name, "texture")
    return None if data is None else decode_texture(data, name, source)
