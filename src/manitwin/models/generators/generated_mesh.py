"""Validation and conversion of the mesh file that a generator produced."""

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

# of the cube of the bounding box's diagonal: a sheet of A4 paper has 8e-4, a needle of 1 x 1 x 1000 has 1e-6
LEAST_VOLUME_SHARE = 1e-8
# Share of the mesh's area that belongs to the repaired solid: 0.29 for 1,000 random faces of a bottle's 5,120, 0.02 for 200;
# 0.5 for a mesh with each face doubled from both sides; everything but inner walls for intact meshes.
LEAST_AREA_SHARE = 0.4
MAX_TEXTURE_PX = 8192  # the largest that generators make; the mesh stage reduces textures to its own limit


def find_flaw(path: Path) -> str | None:
    """Return why a mesh file cannot be used, None if it can.

    The file is read as the mesh stage reads it, and repaired with default settings. Refused are unreadable or truncated
    files; meshes without faces, with non-finite coordinates, or without extent or volume; and meshes that no repair closes to
    a watertight solid, or only one that leaves most of the surface out. An open surface that repair can thicken (a bowl
    without wall thickness) is accepted.
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


def convert_to_glb(path: Path) -> bytes:
    """Return a mesh file as a Y-up GLB; a GLB is returned unchanged, byte for byte.

    For other formats (USDZ) all meshes, textures and materials are kept, one part per mesh and material, and lengths are
    converted to metres if the file states its unit. Raises BadReply if the file cannot be read.
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
