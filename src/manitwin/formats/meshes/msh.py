"""Reader of MuJoCo's binary meshes (.msh): counts, positions, normals, texture coordinates and triangles."""

from __future__ import annotations

import struct

import numpy as np
import trimesh

from manitwin.formats.meshes.point_hull import hull_part
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import DEFAULT_COLOR, make_part, pbr_material
from manitwin.formats.sniff import MSH_HEADER_BYTES, msh_bytes

_REMEDY = "download it again, or export it as OBJ"


def read_msh(source: MeshSource) -> list[trimesh.Trimesh]:
    """Read a mesh of MuJoCo's binary format into one grey part; raises InputError ``unreadable``, ``too_large``."""
    data = source.data()
    if msh_bytes(data[:MSH_HEADER_BYTES]) != len(data):
        raise source.unreadable(f"its counts do not fit its {len(data)} bytes", _REMEDY)
    vertices, normals, coordinates, faces = struct.unpack_from("<4i", data)
    source.check_faces(faces)
    source.check_vertices(vertices)
    numbers = np.frombuffer(data, "<f4", 3 * (vertices + normals) + 2 * coordinates, MSH_HEADER_BYTES)
    indices = np.frombuffer(data, "<i4", 3 * faces, MSH_HEADER_BYTES + numbers.nbytes).reshape(-1, 3)
    if not faces and not source.hull_of_points:
        raise source.refused("no_faces", f"{vertices} vertices and no faces", "export it with triangles")
    if faces and (indices.min() < 0 or indices.max() >= vertices):
        raise source.unreadable("a face refers to a vertex that does not exist", _REMEDY)
    with np.errstate(invalid="ignore"):  # signalling NaNs, which the checks of every mesh find
        positions, directions, uv = np.split(numbers.astype(np.float64), [3 * vertices, 3 * (vertices + normals)])
    if not faces:
        return [hull_part(positions.reshape(-1, 3), source, DEFAULT_COLOR)]
    return [
        make_part(
            positions.reshape(-1, 3),
            indices,
            material=pbr_material(base_color=DEFAULT_COLOR),
            name="mesh",
            uv=_from_upper_left(uv.reshape(-1, 2)) if coordinates else None,
            normals=directions.reshape(-1, 3) if normals else None,
        )
    ]


def _from_upper_left(uv: np.ndarray) -> np.ndarray:
    """Convert texture coordinates with the origin at the upper left, as in MuJoCo, to the origin at the lower left."""
    return np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])
