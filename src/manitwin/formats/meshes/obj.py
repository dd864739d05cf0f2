"""Reader of Wavefront OBJ meshes with their material libraries."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import trimesh
from PIL import Image
from trimesh.visual.material import PBRMaterial

from manitwin.formats.meshes.obj_faces import Faces
from manitwin.formats.meshes.point_hull import hull_part
from manitwin.formats.meshes.shading_normals import triangle_fans
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import (
    DEFAULT_COLOR,
    color_by_corner,
    color_of_lost_texture,
    decode_texture,
    make_part,
    material_of,
    pbr_material,
)
from manitwin.formats.source_files import map_file_name

_MAX_PLAIN_BYTES = 64 << 20  # limit for a text that is split into lines at once; longer ones are read line by line
_MAX_LINE = 64 << 20  # a face may have millions of corners
_MAX_NUMBERS = 4096  # characters in a line of numbers
_MAX_LIBRARIES, _NAME_CHARACTERS = 1000, 4096


@dataclass
class _Document:
    positions: list[str] = field(default_factory=list)
    uv: list[str] = field(default_factory=list)
    normals: list[str] = field(default_factory=list)
    groups: dict[str, Faces] = field(default_factory=dict)
    libraries: list[str] = field(default_factory=list)


def read_obj(source: MeshSource) -> list[trimesh.Trimesh]:
    """Read an OBJ into one part for each material; polygons of any size are cut into triangle fans.

    Raises InputError ``unreadable`` naming the line at which the text is broken.
    """
    data = source.data()
    if len(data) <= _MAX_PLAIN_BYTES:
        plain = plain_triangles(data.decode("utf-8", errors="replace"))
        if plain is not None:
            source.check_faces(len(plain[1]))
            return [make_part(*plain, material=pbr_material(None, base_color=DEFAULT_COLOR), name="mesh")]
    document = _parse(data, source)
    positions = _table(document.positions, 3, "v", source)
    uv = _table(document.uv, 2, "vt", source)
    normals = _table(document.normals, 3, "vn", source)
    colors = _vertex_colors(document.positions)
    materials = _materials(document, source)
    parts = []
    for name, group in document.groups.items():
        sizes, rows = group.rows()
        if not len(rows):  # none of its faces has a corner
            continue
        faces, corners = _unique_corners(sizes, rows, (len(positions), len(uv), len(normals)), source)
        part = make_part(
            positions[corners[:, 0]],
            faces,
            material=materials.get(name) or pbr_material(name or None, base_color=DEFAULT_COLOR),
            name=name or "mesh",
            uv=uv[corners[:, 1]] if len(uv) and corners[:, 1].min() >= 0 else None,
            normals=normals[corners[:, 2]] if len(normals) and corners[:, 2].min() >= 0 else None,
        )
        if colors is not None and material_of(part).baseColorTexture is None:
            part = color_by_corner(part, colors[corners[:, 0]][part.faces], source)
        parts.append(part)
    if not parts and source.hull_of_points:
        return [hull_part(positions, source, DEFAULT_COLOR)]
    if not parts and len(positions):
        raise source.refused(
            "no_faces", f"{len(positions)} vertices and no faces", "export the surface, not a point cloud"
        )
    return parts


def _lines(data: bytes, source: MeshSource) -> Iterator[str]:
    """Yield the lines of a text, joining those that end with a backslash with the next."""
    stream = io.TextIOWrapper(io.BytesIO(data), encoding="utf-8", errors="replace")
    if len(data) < _MAX_LINE and b"\\" not in data:  # no line can be too long, and none is continued
        yield from stream
        return
    joined: list[str] = []
    length = 0
    for line in iter(partial(stream.readline, _MAX_LINE), ""):
        length += len(line)
        if length >= _MAX_LINE:
            raise source.too_large(f"it has a line of more than {_MAX_LINE} characters", "export it again")
        if line.endswith("\\\n"):
            joined.append(line[:-2])
            continue
        yield " ".join([*joined, line]) if joined else line
        joined, length = [], 0
    if joined:
        yield " ".join(joined)


def _parse(data: bytes, source: MeshSource) -> _Document:
    document = _Document()
    tables = {"v": document.positions, "vt": document.uv, "vn": document.normals}
    group: Faces | None = None
    material = ""
    triangles = 0
    most, most_vertices = source.limits.max_faces, source.limits.max_vertices
    for number, line in enumerate(_lines(data, source), start=1):
        words = line.split(None, 1)
        if not words:
            continue
        keyword, rest = words[0], words[1].rstrip() if len(words) > 1 else ""
        if keyword in tables:
            if len(rest) > _MAX_NUMBERS:
                raise source.unreadable(f"line {number} is too long for a {keyword!r}", "export it again")
            if keyword == "vt" and len(rest.split(None, 1)) < 2:
                rest = f"{rest} 0"
            table = tables[keyword]
            table.append(rest)
            if len(table) > most_vertices:
                source.check_vertices(len(table))
        elif keyword == "f":
            if group is None:
                group = document.groups.setdefault(material, Faces(source))
                source.check_parts(len(document.groups))
            # at most one word more than allowed; the rest of the line stays unsplit
            size = len(rest.split(None, most + 3))
            triangles += max(size - 2, 1)
            if triangles > most:
                source.check_faces(triangles)
            group.add(number, line, rest, size, (len(document.positions), len(document.uv), len(document.normals)))
        elif keyword == "usemtl":
            material = rest[:_NAME_CHARACTERS].strip()
            group = None
        elif keyword == "mtllib" and rest and len(document.libraries) < _MAX_LIBRARIES:
            document.libraries.append(rest[:_NAME_CHARACTERS].strip())
    return document


def _unique_corners(
    sizes: np.ndarray, rows: np.ndarray, counts: tuple[int, int, int], source: MeshSource
) -> tuple[np.ndarray, np.ndarray]:
    """Return triangles ``(F, 3)`` of polygons with these corner counts and rows, into unique ``(v, vt, vn)`` rows ``(V, 3)``."""
    for column, (count, what) in enumerate(zip(counts, ("vertex", "texture coordinate", "normal"), strict=True)):
        if column and not count and rows[:, column].max() >= 0:
            rows[:, column] = -1  # optional indices are ignored, as in other loaders
            source.add_finding(f"its faces name {what}s, of which it has none")
        if rows[:, column].max() >= count:
            raise source.unreadable(
                f"a face names {what} {rows[:, column].max() + 1} of {count}",
                "the file is truncated or broken; export it again",
            )
    # sorting one integer for each corner is much faster than sorting rows
    key = rows[:, 0] * (counts[1] + 1) + rows[:, 1] + 1
    if (counts[0] + 1) * (counts[1] + 1) * (counts[2] + 1) >= 2**63:
        key = np.unique(key, return_inverse=True)[1]
    key = key * (counts[2] + 1) + rows[:, 2] + 1
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    fans, _ = triangle_fans(sizes)
    return inverse[fans], rows[first]


def _table(lines: list[str], columns: int, keyword: str, source: MeshSource) -> np.ndarray:
    try:
        return _numbers(lines, range(columns))
    except ValueError as error:
        raise source.unreadable(f"a {keyword!r} line does not contain {columns} numbers", "export it again") from error


def _numbers(lines: list[str], columns: Sequence[int]) -> np.ndarray:
    """Return these columns of lines of numbers, ``(lines, columns)``; raises ValueError if a line is short or not numeric."""
    if not lines:
        return np.empty((0, len(columns)))
    if not all(lines):
        raise ValueError("an empty line")  # which loadtxt would skip
    return np.loadtxt(lines, comments=None, usecols=columns, ndmin=2)


def _vertex_colors(lines: list[str]) -> np.ndarray | None:
    """Return the ``(V, 3) uint8`` sRGB colours that some programs write after positions, or None."""
    if not lines:
        return None
    try:
        colors = _numbers(lines, (3, 4, 5))
    except ValueError:
        return None
    colors = np.clip(np.nan_to_num(colors), -1, 255)
    scale = 255.0 if colors.max() <= 1.0 else 1.0
    return np.clip(np.round(colors * scale), 0, 255).astype(np.uint8)


def _materials(document: _Document, source: MeshSource) -> dict[str, PBRMaterial]:
    materials: dict[str, PBRMaterial] = {}
    for library in dict.fromkeys(document.libraries):
        data = source.sibling(library, "material library")
        if data is not None:
            materials = read_mtl(data.decode("utf-8", errors="replace"), source) | materials
    missing = [name for name in document.groups if name and name not in materials]
    if materials and missing:
        source.add_finding(f"material {missing[0]!r} is in no material library; shown grey")
    return materials


def plain_triangles(text: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Return vertices ``(V, 3)`` and triangles ``(F, 3)`` of a text with only ``v`` and ``f`` lines, None for any other.

    Every vertex is used by a triangle, since the full reader drops unused ones.
    """
    if "/" in text or "\\" in text:
        return None
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    places = [line[2:] for line in lines if line.startswith("v ")]
    corners = [line[2:] for line in lines if line.startswith("f ")]
    if not corners or len(places) + len(corners) != len(lines):
        return None
    # three values in every line, and no line longer than three numbers
    if any(len(line) > _MAX_NUMBERS or len(line.split()) != 3 for line in (*places, *corners)):
        return None
    try:
        vertices = np.array(" ".join(places).split(), dtype=np.float64)
        faces = np.array(" ".join(corners).split(), dtype=np.int64)
    except (ValueError, OverflowError):
        return None
    if not np.isfinite(vertices).all():
        return None
    if len(np.unique(faces)) != len(places) or faces.min() < 1 or faces.max() > len(places):
        return None
    return vertices.reshape(-1, 3), faces.reshape(-1, 3) - 1


def read_mtl(text: str, source: MeshSource) -> dict[str, PBRMaterial]:
    """Return the materials of an MTL file by name.

    Kd (unless there is a map_Kd), d, Ns, Pr, Pm, map_Kd and norm are used. ``Tr`` is ignored, because MeshLab writes 1 for
    opaque.
    """
    materials: dict[str, PBRMaterial] = {}
    entries: list[tuple[str, dict[str, str]]] = []
    for line in text.splitlines():
        keyword, _, rest = line.strip().replace("\t", " ").partition(" ")
        if keyword.lower() == "newmtl":
            entries.append((rest[:_NAME_CHARACTERS].strip(), {}))
            source.check_parts(len(entries))
        elif entries and rest and not keyword.startswith("#"):
            entries[-1][1].setdefault(keyword.lower(), rest.strip())
    for name, values in entries:
        materials.setdefault(name, _material(name, values, source))
    return materials


def _material(name: str, values: dict[str, str], source: MeshSource) -> PBRMaterial:
    texture = _map(values.get("map_kd"), source)
    color = _leading_numbers(values.get("kd")) or DEFAULT_COLOR
    # exporters leave Kd black or grey beside a map, and viewers ignore it
    base = (1.0, 1.0, 1.0) if texture is not None else (*color, *color, *color)[:3]
    if texture is None and "map_kd" in values:
        base = color_of_lost_texture(base)
    opacity = (_leading_numbers(values.get("d")) or [1.0])[0]
    opacity = opacity if 0 < opacity < 1 else 1.0  # d 0 is an invisible object: a known mix-up with Tr
    shininess = max((_leading_numbers(values.get("ns")) or [0.0])[0], 0.0)
    roughness = (_leading_numbers(values.get("pr")) or [(2 / (shininess + 2)) ** 0.25])[0]
    return pbr_material(
        name,
        base_color=(*base, opacity),
        metallic=(_leading_numbers(values.get("pm")) or [0.0])[0],
        roughness=roughness,
        base_color_texture=texture,
        normal_texture=_map(values.get("norm"), source),
        alpha_mode="BLEND" if opacity < 1 else None,
    )


def _map(statement: str | None, source: MeshSource) -> Image.Image | None:
    if statement is None:
        return None
    name = map_file_name(statement)
    data = source.sibling(name, "texture")
    return None if data is None else decode_texture(data, name, source)


def _leading_numbers(text: str | None) -> list[float]:
    numbers: list[float] = []
    for word in (text or "").split():
        try:
            numbers.append(float(word))
        except ValueError:
            break
    return numbers
