"""STL meshes, binary and ASCII: bare triangles without colour, unit or up axis."""

from __future__ import annotations

import re

import numpy as np
import trimesh

from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import make_part, pbr_material
from manitwin.geometry.repair.welding import weld_equal

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 84
_REMEDY = "download or export it again"


def read_stl(source: MeshSource) -> list[trimesh.Trimesh]:
    """Read an STL into one grey part; equal corners are shared so that shading can be smooth.

    Raises InputError ``unreadable`` where the file is cut short.
    """
    data = source.data()
    count = int.from_bytes(data[80:84], "little") if len(data) >= _HEADER else 0
    if len(data) >= _HEADER and len(data) == _HEADER + count * _TRIANGLE.itemsize:
        source.check_faces(count)
        corners = np.frombuffer(data, dtype=_TRIANGLE, offset=_HEADER)["vertices"].reshape(-1, 3).astype(np.float64)
    elif re.match(rb"\s*solid\b", data, re.IGNORECASE):
        corners = _ascii(data.decode("utf-8", errors="replace"), source)
    else:
        raise source.unreadable(
            f"truncated: it says {count} triangles and has {len(data)} bytes",
            _REMEDY,
        )
    vertices, faces = weld_equal(corners, np.arange(len(corners)).reshape(-1, 3))
    return [make_part(vertices, faces, material=pbr_material(base_color=(0.8, 0.8, 0.8)), name="mesh")]


def _ascii(text: str, source: MeshSource) -> np.ndarray:
    rows = re.findall(r"^\s*vertex\s+(\S+)\s+(\S+)\s+(\S+)\s*$", text, re.IGNORECASE | re.MULTILINE)
    source.check_faces(len(rows) // 3)
    facets = len(re.findall(r"^\s*facet\b", text, re.IGNORECASE | re.MULTILINE))
    if len(rows) != 3 * facets:
        raise source.unreadable(f"truncated or broken: {facets} facets and {len(rows)} corners", _REMEDY)
    try:
        return np.array(rows, dtype=np.float64).reshape(-1, 3)
    except ValueError as error:
        raise source.unreadable("a vertex does not hold three numbers", _REMEDY) from error
