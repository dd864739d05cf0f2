"""Real meshes as watertight solids in the object frame, for tests."""

import csv
from pathlib import Path

import numpy as np
import trimesh

from manitwin.geometry.repair.cascade import repair

Y_UP = ("bowl_evo", "plate_8in", "tomato_soup_can", "salt_shaker", "gelatin_box")
VESSELS = {"mug_ycb": 0.85, "bowl_evo": 0.85, "frypan_8in": 0.85, "utensil_holder": 0.85, "sneaker": 0.80}
"""Of these the hulls must keep at least that share of the open cavity."""


def mesh_rows(data: Path) -> dict[str, dict[str, str]]:
    """Return the manifest's rows of meshes by folder name."""
    with (data / "manifest.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["kind"] == "mesh"]
    return {row["file"].split("/")[1]: row for row in rows}


def load_real_mesh(data: Path, name: str) -> trimesh.Trimesh:
    """Load, repair, turn Z-up and stand on the origin."""
    loaded = trimesh.load(data / mesh_rows(data)[name]["file"])
    mesh = loaded.to_mesh() if isinstance(loaded, trimesh.Scene) else loaded
    vertices = np.array(mesh.vertices, dtype=float)
    if name in Y_UP:
        vertices = np.stack([vertices[:, 0], -vertices[:, 2], vertices[:, 1]], axis=1)
    low, high = vertices.min(0), vertices.max(0)
    vertices -= [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]]
    return repair(trimesh.Trimesh(vertices, np.array(mesh.faces), process=False)).mesh


def cup(radius_m: float = 0.040, height_m: float = 0.100, wall_m: float = 0.003, sides: int = 256) -> trimesh.Trimesh:
    """Return a cup with both walls, a flat bottom of the wall's thickness, opening up, standing on z = 0."""
    profile = [(0, 0), (radius_m, 0), (radius_m, height_m), (radius_m - wall_m, height_m), (radius_m - wall_m, wall_m)]
    mesh = trimesh.creation.revolve(np.array([*profile, (0, wall_m)]), sections=sides)
    return trimesh.Trimesh(mesh.vertices, mesh.faces if mesh.volume > 0 else mesh.faces[:, ::-1], process=False)
