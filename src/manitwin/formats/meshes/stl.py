"""Reader of STL meshes, ASCII and binary."""

from __future__ import annotations

import io
from functools import partial

import numpy as np
import trimesh

from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import DEFAULT_COLOR, make_part, pbr_material
from manitwin.geometry.repair.welding import weld_equal

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 84
_REMEDY = "download or export it again"
_BEGIN_BYTES = 1 << 16
_LINE_BYTES = 4096
_ROWS = 30_000


def read_stl(source: MeshSource) -> list[trimesh.Trimesh]:
    """Read an STL into one grey part; equal corners are merged so that shading can be smooth.

    Raises InputError ``unreadable`` for a truncated file.
    """
    data = source.data()
    count = int.from_bytes(data[80:84], "little") if len(data) >= _HEADER else 0
    if len(data) >= _HEADER and len(data) == _HEADER + count * _TRIANGLE.itemsize:
        source.check_faces(count)
        corners = np.frombuffer(data, dtype=_TRIANGLE, offset=_HEADER)["vertices"].reshape(-1, 3).astype(np.float64)
    elif data[:_BEGIN_BYTES].lstrip()[:5].lower() == b"solid":
        corners = _ascii(data, source)
    else:
        raise source.unreadable(
            f"truncated: it declares {count} triangles but has {len(data)} bytes",
            _REMEDY,
        )
    vertices, faces = weld_equal(corners, np.arange(len(corners)).reshape(-1, 3))
    return [make_part(vertices, faces, material=pbr_material(base_color=DEFAULT_COLOR), name="mesh")]


def _ascii(data: bytes, source: MeshSource) -> np.ndarray:
    """Return the corners ``(3 F, 3)`` of an ASCII STL, from the lines that begin with ``vertex``."""
    blocks: list[np.ndarray] = []
    rows: list[list[bytes]] = []
    facets = count = 0
    for line in iter(partial(io.BytesIO(data).readline, _LINE_BYTES), b""):
        words = line.split()
        keyword = words[0].lower() if words else b""
        if keyword == b"vertex" and len(words) == 4:
            rows.append(words[1:])
            count += 1
            if len(rows) == _ROWS:
                source.check_faces(count // 3)
                blocks.append(_numbers(rows, source))
                rows = []
        elif keyword == b"facet":
            facets += 1
    source.check_faces(count // 3)
    if count != 3 * facets:
        raise source.unreadable(f"truncated or broken: {facets} facets and {count} corners", _REMEDY)
    return np.concatenate([*blocks, _numbers(rows, source)])


def _numbers(rows: list[list[bytes]], source: MeshSource) -> np.ndarray:
    try:
        return np.array(rows, dtype=np.float64).reshape(-1, 3)
    except ValueError as error:
        raise source.unreadable("a vertex does not have three numbers", _REMEDY) from error
