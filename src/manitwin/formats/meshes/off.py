"""Reader of OFF meshes (Geomview's object file format) in text form, with colours, normals or texture coordinates."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.formats.meshes.shading_normals import triangle_fans
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import DEFAULT_COLOR, color_by_corner, make_part, pbr_material
from manitwin.formats.sniff import OFF_KEYWORD

_REMEDY = "export it again, or as OBJ"
_COLORS = (0, 1, 3, 4)  # numbers after a face's corners: none, an index into a colour map, RGB, RGBA


def read_off(source: MeshSource) -> list[trimesh.Trimesh]:
    """Read an OFF text into one part; polygons are cut into triangle fans, colours are those of vertices or faces.

    Raises InputError: ``unreadable``, ``too_large``, ``no_faces``. Source: Geomview's manual, "OFF: Object File Format". The
    counts may follow the keyword in its line, even without a space, as in ModelNet40 (Wu et al. 2015).
    """
    text = source.data().decode("utf-8", errors="replace").lstrip("\ufeff \t\r\n")
    header = OFF_KEYWORD.match(text)
    if header is None or text[header.end() :].lstrip()[:6].upper() == "BINARY":
        raise source.unreadable("it is not an OFF text", _REMEDY)
    textured, colored, normals, *more = (said is not None for said in header.groups())
    if any(more):
        raise source.unreadable("its vertices have more than three coordinates", _REMEDY)
    lines = [words for line in text[header.end() :].splitlines() if (words := line.partition("#")[0].split())]
    vertices, faces = _counts(lines, source)
    rows = _numbers(lines[1 : 1 + vertices], source)
    columns = 3 + 3 * normals
    if rows.shape[1] < columns + 3 * colored + 2 * textured:
        raise source.unreadable("a vertex has too few numbers", _REMEDY)
    sizes, corners, colors = _polygons(lines[1 + vertices : 1 + vertices + faces], vertices, source)
    fans, owner = triangle_fans(sizes)
    source.check_faces(len(fans))
    part = make_part(
        rows[:, :3],
        corners[fans],
        material=pbr_material(base_color=DEFAULT_COLOR),
        name="mesh",
        normals=rows[:, 3:6] if normals else None,
    )
    if colored:
        return [color_by_corner(part, _rgb(rows[:, columns : columns + 3])[part.faces], source)]
    if colors is not None:
        return [color_by_corner(part, np.repeat(_rgb(colors)[owner][:, None], 3, axis=1), source)]
    return [part]


def _counts(lines: list[list[str]], source: MeshSource) -> tuple[int, int]:
    """Return the numbers of vertices and faces, after checking that the text has as many lines."""
    said = lines[0] if lines else []
    if len(said) < 2 or not all(word.isascii() and word.isdigit() and len(word) < 18 for word in said[:2]):
        raise source.unreadable("its counts of vertices and faces are missing", _REMEDY)
    vertices, faces = int(said[0]), int(said[1])
    source.check_vertices(vertices)
    source.check_faces(faces)
    if not faces:
        raise source.refused("no_faces", f"{vertices} vertices and no faces", "export the surface, not points")
    if len(lines) - 1 < vertices + faces:
        cause = f"truncated: it declares {vertices} vertices and {faces} faces but has {len(lines) - 1} lines"
        raise source.unreadable(cause, "download or export it again")
    return vertices, faces


def _numbers(lines: list[list[str]], source: MeshSource) -> np.ndarray:
    width = len(lines[0]) if lines else 0
    if any(len(words) != width for words in lines):
        raise source.unreadable("its vertices do not have as many numbers each", _REMEDY)
    return np.array(lines, np.float64).reshape(len(lines), width)


def _polygons(
    lines: list[list[str]], vertices: int, source: MeshSource
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Return the corner counts ``(P,)``, the concatenated corners, and colours ``(P, 3)`` if every face has one."""
    sizes = np.array([int(words[0]) for words in lines], np.int64)
    if sizes.min() < 1 or any(len(words) - 1 < size for words, size in zip(lines, sizes.tolist(), strict=True)):
        raise source.unreadable("a face has fewer corners than it declares", _REMEDY)
    corners = np.array(
        [word for words, size in zip(lines, sizes, strict=True) for word in words[1 : 1 + size]], np.int64
    )
    if corners.min() < 0 or corners.max() >= vertices:
        raise source.unreadable("a face refers to a vertex that does not exist", _REMEDY)
    said = [words[1 + size :] for words, size in zip(lines, sizes, strict=True)]
    if any(len(words) not in _COLORS for words in said):
        source.add_finding("numbers behind its faces that are no colours were left out")
        return sizes, corners, None
    if all(len(words) >= 3 for words in said):
        return sizes, corners, np.array([words[:3] for words in said], np.float64)
    if any(said):
        source.add_finding("colours of some faces, or by a map, were left out")
    return sizes, corners, None


def _rgb(colors: np.ndarray) -> np.ndarray:
    """Return colours ``(N, 3) uint8`` from values in 0..1, or from bytes if any value is above one."""
    known = np.nan_to_num(colors)
    return np.rint(np.clip(known if known.max() > 1 else 255 * known, 0, 255)).astype(np.uint8)
