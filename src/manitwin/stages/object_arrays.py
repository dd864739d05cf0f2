"""The arrays of an object that later stages read: solid mesh and collision hulls, in the object frame in metres."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh


def load_solid(path: Path) -> trimesh.Trimesh:
    """Load the watertight mesh of ``solid.npz``."""
    with np.load(path) as arrays:
        return trimesh.Trimesh(arrays["vertices"], arrays["faces"], process=False)


def load_hulls(path: Path) -> tuple[np.ndarray, ...]:
    """Load the convex vertices of ``hulls.npz``, each ``(V, 3)``, in the order of their names."""
    with np.load(path) as arrays:
        return tuple(arrays[name] for name in sorted(arrays.files))
