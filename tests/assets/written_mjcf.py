"""MJCF files for the tests of their reader."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh


def mjcf(folder: Path, worldbody: str, before: str = "", name: str = "object.xml") -> Path:
    """Write an MJCF file."""
    path = folder / name
    path.write_text(f"<mujoco>{before}<worldbody>{worldbody}</worldbody></mujoco>")
    return path


def wedge() -> trimesh.Trimesh:
    """Return a solid without symmetry, off its origin."""
    return trimesh.convex.convex_hull(np.array([[5, 0, 0], [8, 0, 0], [5, 2, 0], [5, 0, 1.0], [6, 1, 1]]))
