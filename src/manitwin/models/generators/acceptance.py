"""Whether a generated mesh can become a twin at all: the failure classes of the paper's "Asset Generation"."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh
from manitwin.geometry.repair.cascade import repair
from manitwin.geometry.repair.surface import signed_volumes

# of the cube over the bounding box's diagonal: a sheet of A4 paper has 8e-4, a needle of 1 x 1 x 1000 has 1e-6
LEAST_VOLUME_SHARE = 1e-8
# of the mesh's area that is part of the solid. Of 1,000 scraps of a bottle's 5,120 faces 0.29 is, of 200 0.02; of a mesh
# that shows every face from both sides 0.5, of whole ones all but inner walls.
LEAST_AREA_SHARE = 0.4


def flaw(path: Path) -> str | None:
    """Return why a mesh file cannot be used, None where it can.

    It is read as the mesh stage reads it, and repaired with its default settings: unreadable, truncated or compressed
    files, meshes without faces, with coordinates that are not finite, without extent or volume, and those that no repair
    closes to a watertight solid, or only by leaving most of the surface out. An open sheet that repair can give a wall to
    (a bowl without thickness) is not refused.
    """
    try:
        parts = read_mesh(path).parts
    except InputError as error:
        return error.detail
    vertices, faces = trimesh.util.append_faces([part.vertices for part in parts], [part.faces for part in parts])
    diagonal = float(np.linalg.norm(np.ptp(vertices[np.unique(faces)], axis=0)))
    if diagonal == 0.0:
        return f"{path.name}: all of it lies in one point"
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
