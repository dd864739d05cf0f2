"""Decompose real meshes into convex hulls, and print the cost and how well the hulls approximate the meshes.

    python benchmarks/hulls.py DATA [--only NAME ...] [--samples N]

DATA holds manifest.csv and meshes/. CPU seconds are those of finding the opening and decomposing. Errors are in mm, over mesh
surface outside the hulls and hull surface outside the mesh; uncovered is the largest distance of the mesh surface to the hulls.
Cavity is the share of the open cavity that is kept. The ball is dropped into the opening in SAPIEN.
"""

from __future__ import annotations

import argparse
import csv
import io
import time
from pathlib import Path

import manifold3d
import numpy as np
import trimesh

from manitwin.config import CollisionConfig
from manitwin.geometry.cavity import find_opening
from manitwin.geometry.hulls.decomposition import convex_decomposition
from manitwin.geometry.hulls.error import hull_error, hull_union
from manitwin.geometry.hulls.reduction import hull_to_obj
from manitwin.geometry.repair.cascade import repair
from manitwin.physics.sapien.settle import ball_stays_inside

Y_UP = ("bowl_evo", "plate_8in", "tomato_soup_can", "salt_shaker", "gelatin_box")  # glTF, and two OBJ files from glTF


def load(path: Path, y_up: bool) -> trimesh.Trimesh:
    """Load a mesh file as a watertight solid with Z up."""
    loaded = trimesh.load(path)
    mesh = loaded.to_mesh() if isinstance(loaded, trimesh.Scene) else loaded
    x, y, z = np.array(mesh.vertices, dtype=float).T
    vertices = np.stack([x, -z, y] if y_up else [x, y, z], axis=1)
    return repair(trimesh.Trimesh(vertices, np.array(mesh.faces), process=False)).mesh


def manifold(mesh: trimesh.Trimesh) -> manifold3d.Manifold:
    """Return the mesh as a solid of manifold3d."""
    vertices = np.array(mesh.vertices, dtype=np.float64, order="C")  # manifold3d refuses read-only arrays
    return manifold3d.Manifold(manifold3d.Mesh64(vertices, np.array(mesh.faces, dtype=np.uint64, order="C")))


def intersection_over_union(mesh: trimesh.Trimesh, union: trimesh.Trimesh) -> float:
    """Return the volume of the intersection divided by that of the union."""
    shared = (manifold(mesh) ^ manifold(union)).volume()
    return float(shared / (mesh.volume + union.volume - shared))


def loads_convex(hull: np.ndarray) -> bool:
    """Tell whether trimesh finds a hull convex after it was written and read."""
    return bool(trimesh.load(io.BytesIO(hull_to_obj(hull)), file_type="obj", force="mesh").is_convex)


def main() -> None:
    """Print one row per mesh and a summary."""
    parser = argparse.ArgumentParser(description="Convex hulls of real meshes.")
    parser.add_argument("data", type=Path)
    parser.add_argument("--only", nargs="+", default=None)
    parser.add_argument("--samples", type=int, default=12_000)
    arguments = parser.parse_args()
    settings = CollisionConfig()
    with (arguments.data / "manifest.csv").open(newline="") as file:
        files = {row["file"].split("/")[1]: row["file"] for row in csv.DictReader(file) if row["kind"] == "mesh"}
    heads = [
        "mesh",
        "CPU-s",
        "hulls",
        "most vertices",
        "p95",
        "max",
        "uncovered",
        "IoU",
        "box off",
        "cavity",
        "ball in",
        "convex",
        "how",
    ]
    print("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
    rows = []
    for name in arguments.only or files:
        mesh = load(arguments.data / files[name], name in Y_UP)
        start = time.process_time()
        opening = find_opening(mesh)
        found = convex_decomposition(
            mesh,
            max_hulls=settings.max_hulls,
            max_vertices=settings.max_vertices,
            oversplit=settings.oversplit,
            opening=opening,
        )
        cpu_s = time.process_time() - start
        error = hull_error(mesh, found.hulls, opening, np.random.default_rng(0), arguments.samples)
        iou = intersection_over_union(mesh, hull_union(found.hulls))
        corners = np.vstack(found.hulls)
        box_off_mm = float(np.abs(np.array([corners.min(0), corners.max(0)]) - mesh.bounds).max()) * 1e3
        ball = "-" if opening is None else ball_stays_inside(found.hulls, opening)
        cavity = "-" if error.cavity_kept is None else f"{error.cavity_kept:.3f}"
        p95, most, uncovered = (
            1e3 * value
            for value in (error.surface_error_p95_m, error.surface_error_max_m, error.surface_uncovered_max_m)
        )
        convex = sum(map(loads_convex, found.hulls))
        vertices = max(map(len, found.hulls))
        cells = [name, f"{cpu_s:.2f}", len(found.hulls), vertices, f"{p95:.2f}", f"{most:.2f}", f"{uncovered:.2f}"]
        cells += [f"{iou:.3f}", f"{box_off_mm:.2f}", cavity, ball, f"{convex}/{len(found.hulls)}", found.method]
        print("| " + " | ".join(map(str, cells)) + " |", flush=True)
        rows.append((cpu_s, p95, uncovered, iou))
    cpu_s, p95, uncovered, iou = np.array(rows).T
    print(
        f"CPU-s median {np.median(cpu_s):.2f}, max {cpu_s.max():.2f}, sum {cpu_s.sum():.1f};"
        f" p95 median {np.median(p95):.2f} mm; uncovered max {uncovered.max():.2f} mm; IoU mean {iou.mean():.3f}"
    )


if __name__ == "__main__":
    main()
