"""Reading of a twin's mesh files: the visual mesh and the convex collision hulls."""

from __future__ import annotations

import os
from collections.abc import Iterable
from fnmatch import fnmatch
from pathlib import Path

import numpy as np
import trimesh

from manitwin.errors import InputError, TwinError
from manitwin.formats.bounded_file import open_regular, read_bytes
from manitwin.formats.glb import read_glb
from manitwin.formats.xml_file import MAX_NUMBER
from manitwin.twin.store import REMEDY

MAX_HULL_BYTES = 16 << 20
HULLS = "collision/hull_*.obj"
"""Pattern of the hull files among a record's files."""


def read_visual(path: Path) -> list[trimesh.Trimesh]:
    """Return the parts of a twin's ``visual.glb`` in the object frame. Raises TwinError."""
    if not os.path.lexists(path):
        raise TwinError(f"{path}: missing; {REMEDY}")
    open_regular(path, TwinError, inside=path.parent, name=str(path)).close()
    try:
        parts = read_glb(path)
    except InputError as error:
        raise TwinError(f"{path}: cannot be read ({error.detail}); {REMEDY}") from error
    if not all(np.isfinite(part.vertices).all() for part in parts):
        raise TwinError(f"{path}: has vertices that are not finite; {REMEDY}")
    return parts


def read_hulls(folder: Path, files: Iterable[str]) -> list[trimesh.Trimesh]:
    """Return the convex hulls of a twin's folder in the object frame; ``files`` are those of its record. Raises TwinError."""
    named = sorted(name for name in files if fnmatch(name, HULLS))
    if missing := [name for name in named if not os.path.lexists(folder / name)]:
        raise TwinError(f"{folder}: {', '.join(missing)} missing; {REMEDY}")
    return [_hull(path, folder) for path in sorted(folder.glob(HULLS))]


def _hull(path: Path, folder: Path) -> trimesh.Trimesh:
    """Read the vertices and triangles of a hull's OBJ file, ignoring all other lines. Raises TwinError."""
    content = read_bytes(path, MAX_HULL_BYTES, TwinError, inside=folder, name=str(path))
    rows = [line.split() for line in content.splitlines() if line.strip()]
    try:
        vertices = np.array([row[1:4] for row in rows if row[0] == b"v"], np.float64).reshape(-1, 3)
        corners = [[word.partition(b"/")[0] for word in row[1:]] for row in rows if row[0] == b"f"]
        faces = np.array(corners, np.int64).reshape(-1, 3) - 1
    except (ValueError, OverflowError) as error:
        raise TwinError(f"{path}: not a readable hull ({str(error)[:120]}); {REMEDY}") from error
    if not len(faces) or not (np.abs(vertices) <= MAX_NUMBER).all() or faces.min() < 0 or faces.max() >= len(vertices):
        raise TwinError(f"{path}: not a hull with finite vertices and triangles; {REMEDY}")
    return trimesh.Trimesh(vertices, faces, process=False)
