"""Groups of an OBJ file: some engines build one convex hull for each group, so that one file can hold a decomposition."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from manitwin.assets.asset_files import MESH_LIMITS
from manitwin.errors import AssetError
from manitwin.formats.bounded_file import read_bytes

MOST_GROUPS = 1024


def obj_groups(path: Path) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return vertices ``(V, 3)``, in the file's unit, and faces ``(F, 3)`` of each ``o`` or ``g`` group that has faces.

    Returns an empty list for a file with one group or more than ``MOST_GROUPS``, and for other formats. The file must have been
    read as a mesh before, which validates it.
    """
    if path.suffix.lower() != ".obj":
        return []
    try:
        return _parsed(path)
    except (ValueError, IndexError):  # such as continued lines: the file then counts as one group
        return []


def _parsed(path: Path) -> list[tuple[np.ndarray, np.ndarray]]:
    positions: list[list[float]] = []
    groups: list[list[list[int]]] = [[]]
    for line in read_bytes(path, MESH_LIMITS.max_bytes, AssetError).splitlines():
        keyword, _, rest = line.partition(b" ")
        if keyword == b"v":
            positions.append([float(word) for word in rest.split()[:3]])
        elif keyword == b"f":
            corners = [int(word.partition(b"/")[0]) for word in rest.split()]
            corners = [corner - 1 if corner > 0 else len(positions) + corner for corner in corners]
            groups[-1] += [[corners[0], *corners[i : i + 2]] for i in range(1, len(corners) - 1)]
        elif keyword in (b"o", b"g") and groups[-1]:
            groups.append([])
    filled = [np.array(group) for group in groups if group]
    if not 1 < len(filled) <= MOST_GROUPS:
        return []
    vertices = np.array(positions)
    found = []
    for faces in filled:
        used, indices = np.unique(faces, return_inverse=True)
        found.append((vertices[used], indices.reshape(-1, 3)))
    return found
