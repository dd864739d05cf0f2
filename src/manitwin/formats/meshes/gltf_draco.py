"""Geometry of glTF documents compressed by Draco (KHR_draco_mesh_compression)."""

from __future__ import annotations

from typing import Any

import numpy as np

from manitwin.formats.isolated import Limits, ProcessCrashed, run_isolated
from manitwin.formats.meshes.gltf_document import Accessors
from manitwin.formats.meshes.source import MeshSource

DRACO = "KHR_draco_mesh_compression"
_LIMITS = Limits(seconds=120.0, memory_bytes=4 << 30)
_REMEDY = "export it again, or without compression"


def decompress(primitive: dict[str, Any], accessors: Accessors, source: MeshSource) -> bool:
    """Decode a primitive's Draco data into the accessors that it names; return whether it has such data.

    If the accessors have their own data, for readers without Draco, nothing is decoded. The result is a list of triangles,
    whatever the mode of the primitive. Raises InputError ``unreadable``, ``too_large``.
    """
    extensions = primitive.get("extensions")
    compressed = extensions.get(DRACO) if isinstance(extensions, dict) else None
    attributes, indices = primitive.get("attributes", {}), primitive.get("indices")
    if compressed is None or accessors.has_data(attributes.get("POSITION")):
        return False
    if not isinstance(compressed, dict) or not isinstance(ids := compressed.get("attributes"), dict) or indices is None:
        raise source.unreadable(f"its {DRACO} names no attributes or indices", _REMEDY)
    if not accessors.is_filled(indices):
        data = bytes(accessors.view(compressed.get("bufferView")))
        source.check_faces(accessors.count(indices) // 3)
        source.check_vertices(accessors.count(attributes["POSITION"]))
        faces, values = _decode_isolated(data, source)
        source.check_faces(len(faces))
        accessors.fill(indices, faces.reshape(-1, 1))
        for name, number in ids.items():
            if not isinstance(number, int) or number not in values:
                raise source.unreadable(f"its Draco data has no attribute {str(number)[:20]} for {name[:40]}", _REMEDY)
            source.check_vertices(len(values[number]))
            accessors.fill(attributes.get(name), values[number])
    return True


def _decode_isolated(data: bytes, source: MeshSource) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    try:
        faces, values = run_isolated(f"{__name__}:decoded", data, limits=_LIMITS)
    except (ProcessCrashed, ValueError, MemoryError) as error:
        raise source.unreadable(f"its {DRACO} data is broken", _REMEDY) from error
    return faces, values


def decoded(data: bytes) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Return the faces ``(F, 3) uint32`` of a mesh compressed by Draco, and its attributes ``(V, k)`` by unique id.

    Raises ValueError for data that Google's decoder refuses.
    """
    import DracoPy

    try:
        mesh = DracoPy.decode(data)
    except (DracoPy.FileTypeException, ValueError, RuntimeError) as error:
        raise ValueError("Draco cannot decode the mesh") from error
    faces = getattr(mesh, "faces", None)
    if faces is None or not len(faces):
        raise ValueError("points without faces")
    return np.asarray(faces, np.uint32), {int(each["unique_id"]): np.asarray(each["data"]) for each in mesh.attributes}
