"""Check and convert the mesh file that a generator made."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from manitwin.errors import BadReply, InputError
from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.read import MeshFile, read_mesh
from manitwin.formats.meshes.textures import bake_transform
from manitwin.formats.sniff import sniff
from manitwin.geometry.poses import GLTF_TO_OBJECT
from manitwin.geometry.repair.cascade import repair
from manitwin.geometry.repair.surface import signed_volumes

# of the cube over the bounding box's diagonal: a sheet of A4 paper has 8e-4, a needle of 1 x 1 x 1000 has 1e-6
LEAST_VOLUME_SHARE = 1e-8
# of the mesh's area that is part of the solid. Of 1,000 scraps of a bottle's 5,120 faces 0.29 is, of 200 0.02; of a mesh
# that shows every face from both sides 0.5, of whole ones all but inner walls.
LEAST_AREA_SHARE = 0.4
MAX_TEXTURE_PX = 8192  # the largest that generators make; the mesh stage brings them down to its own limit


def flaw(path: Path) -> str | None:
    """Return why a mesh file cannot be used, None where it can.

    It is read as the mesh stage reads it, and repaired with its default settings: unreadable or truncated files, meshes without
    faces, with coordinates that are not finite, without extent or volume, and those that no repair closes to a watertight
    solid, or only by leaving most of the surface out. An open sheet that repair can give a wall to (a bowl without thickness)
    is not refused.
    """
    try:
        parts = read_mesh(path).parts
    except InputError as error:
        return error.detail
    vertices, faces = trimesh.util.append_faces([part.vertices for part in parts], [part.faces for part in parts])
    diagonal = float(np.linalg.norm(np.ptp(vertices[np.unique(faces)], axis=0)))
    if diagonal == 0.0:
        return f"{path.name}: all of its vertices coincide"
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    result = repair(mesh)
    if not result.watertight:
        return f"{path.name}: it cannot be closed to a watertight solid ({result.actions[-1]})"
    areas = np.asarray(mesh.area_faces)
    kept = areas[np.unique(result.source_face[result.source_face >= 0])].sum() / max(areas.sum(), np.finfo(float).tiny)
    if kept < LEAST_AREA_SHARE:
        return f"{path.name}: no watertight solid has more than {kept:.0%} of its surface"
    solid = result.mesh
    volume = float(
        signed_volumes(np.asarray(solid.vertices), np.asarray(solid.faces), np.zeros(len(solid.faces), int))[0]
    )
    if volume < LEAST_VOLUME_SHARE * diagonal**3:
        return f"{path.name}: it encloses no volume"
    return None


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
