"""A generated mesh file as the binary glTF that the pipeline keeps."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from manitwin.errors import BadReply, InputError
from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.read import MeshFile, read_mesh
from manitwin.formats.meshes.textures import bake_transform
from manitwin.formats.sniff import sniff
from manitwin.geometry.poses import GLTF_TO_OBJECT

MAX_TEXTURE_PX = 8192  # the largest that generators make; the mesh stage brings them down to its own limit


def as_glb(path: Path) -> bytes:
    """Return a mesh file as a Y-up GLB: one that is a GLB already stays as it is, byte for byte.

    Of any other format (USDZ) all meshes, textures and materials are kept, one part a mesh and material; lengths become
    metres where the file says its unit. Raises BadReply where it cannot be read.
    """
    try:
        if sniff(path).format == "glb":
            return path.read_bytes()
        file = read_mesh(path)
    except InputError as error:
        raise BadReply(f"the generator's file cannot be used: {error.detail}") from error
    to_object = _to_object(file)
    return write_glb([bake_transform(part, to_object) for part in file.parts], max_texture_size=MAX_TEXTURE_PX)


def _to_object(file: MeshFile) -> np.ndarray:
    """Return the transform ``(4, 4)`` from the file's unit and axes to metres with Z up."""
    scale = file.unit_m or 1.0
    turn = np.eye(4) if file.up == "z" else GLTF_TO_OBJECT
    return np.asarray(turn) @ np.diag([scale, scale, scale, 1.0])
