"""Damage real meshes in four ways, repair the copies, and print how many became solids and their error.

    python benchmarks/repair_damaged.py DATA [--only NAME ...] [--seed N]

DATA holds manifest.csv and meshes/. The kinds of damage are: holes (three patches of radius 2 % of the diagonal), flip (10 % of
the faces reversed), soup (all triangles separate, 2 um of noise), skin (faces not visible from 48 views deleted), and none.
Errors are 95th percentiles of the distance from 12,000 surface points to the other mesh, the larger of both directions. Open cups
and bowls generated here, outer surface only, must keep their opening.
"""

from __future__ import annotations

import argparse
import csv
import time
from collections.abc import Callable
from pathlib import Path

import manifold3d
import numpy as np
import trimesh

from manitwin.geometry.distance import distance_to_surface
from manitwin.geometry.repair.cascade import RepairResult, repair
from manitwin.geometry.repair.thickening import fibonacci_sphere
from manitwin.geometry.repair.welding import weld_equal
from manitwin.geometry.sampling import sample_surface

SAMPLES = 12_000
VIEWS = 48


def load(path: Path) -> trimesh.Trimesh:
    """Load a mesh file as one triangle soup in the file's units."""
    loaded = trimesh.load(path, process=False)
    mesh = loaded.to_geometry() if isinstance(loaded, trimesh.Scene) else loaded
    return trimesh.Trimesh(*weld_equal(np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces)), process=False)


def diagonal_m(mesh: trimesh.Trimesh) -> float:
    """Return the diagonal of the axis-aligned box, metres."""
    return float(np.linalg.norm(mesh.extents))


def holes(mesh: trimesh.Trimesh, rng: np.random.Generator) -> trimesh.Trimesh:
    """Delete the faces with centres within 2 % of the diagonal of three surface points."""
    centers, _, _ = sample_surface(mesh, 3, rng)
    apart = np.linalg.norm(mesh.triangles_center[:, None] - centers[None], axis=-1)
    gone = (apart < 0.02 * diagonal_m(mesh)).any(1)
    gone[apart.argmin(0)] = True
    return trimesh.Trimesh(mesh.vertices, mesh.faces[~gone], process=False)


def flip(mesh: trimesh.Trimesh, rng: np.random.Generator) -> trimesh.Trimesh:
    """Reverse 10 % of the faces."""
    faces = np.array(mesh.faces)
    turned = rng.random(len(faces)) < 0.1
    faces[turned] = faces[turned][:, ::-1]
    return trimesh.Trimesh(mesh.vertices, faces, process=False)


def soup(mesh: trimesh.Trimesh, rng: np.random.Generator) -> trimesh.Trimesh:
    """Separate all triangles and displace every corner by noise of 2 um standard deviation."""
    corners = mesh.triangles.reshape(-1, 3)
    noisy = corners + rng.normal(0, 2e-6, corners.shape)
    return trimesh.Trimesh(noisy, np.arange(len(noisy)).reshape(-1, 3), process=False)


def skin(mesh: trimesh.Trimesh, rng: np.random.Generator) -> trimesh.Trimesh:
    """Delete the faces of which neither the centre nor a point near a corner is visible from 48 viewpoints."""
    corners, middle = mesh.triangles, mesh.triangles_center
    spots = np.concatenate((middle[:, None], 0.8 * corners + 0.2 * middle[:, None]), axis=1)
    seen = np.zeros(len(corners), dtype=bool)
    center = mesh.bounds.mean(0)
    for eye in center + 2 * diagonal_m(mesh) * fibonacci_sphere(VIEWS):
        for column in spots.swapaxes(0, 1):
            rest = np.flatnonzero(~seen & (((eye - middle) * mesh.face_normals).sum(1) > 0))
            first = mesh.ray.intersects_first(np.repeat(eye[None], len(rest), axis=0), column[rest] - eye)
            seen[rest[first == rest]] = True
    return trimesh.Trimesh(mesh.vertices, mesh.faces[seen], process=False)


def none(mesh: trimesh.Trimesh, rng: np.random.Generator) -> trimesh.Trimesh:
    """Return the mesh unchanged."""
    return mesh


DAMAGES: dict[str, Callable[[trimesh.Trimesh, np.random.Generator], trimesh.Trimesh]] = {
    "none": none, "holes": holes, "flip": flip, "soup": soup, "skin": skin,
}  # fmt: skip


def is_solid(result: RepairResult) -> bool:
    """Tell whether both trimesh and manifold3d accept the result as a solid."""
    mesh = result.mesh
    manifold = manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(mesh.vertices, dtype=float), np.ascontiguousarray(mesh.faces, dtype=np.uint64)
        )
    )
    closed = result.watertight and mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0
    return bool(closed and manifold.status() == manifold3d.Error.NoError)


def error_mm(original: trimesh.Trimesh, repaired: trimesh.Trimesh) -> tuple[float, float]:
    """Return the 95th percentile and the maximum of the distance, the larger of both directions, in mm."""
    there = distance_to_surface(sample_surface(original, SAMPLES, np.random.default_rng(1))[0], repaired)
    back = distance_to_surface(sample_surface(repaired, SAMPLES, np.random.default_rng(2))[0], original)
    return (
        1e3 * max(float(np.percentile(there, 95)), float(np.percentile(back, 95))),
        1e3 * max(float(there.max()), float(back.max())),
    )


def open_cup(
    radius_m: float, height_m: float, flare: float = 1.0, sections: int = 64, rings: int = 20
) -> trimesh.Trimesh:
    """Make the outer surface of a cup: a disc and a wall, no inside, no lid; ``flare`` is the ratio of top to bottom radius."""
    angle = 2 * np.pi * np.arange(sections) / sections
    radii = np.concatenate((np.linspace(0.1, 1, 6) * radius_m, np.linspace(1, flare, rings + 1)[1:] * radius_m))
    heights = np.concatenate((np.zeros(6), np.linspace(0, height_m, rings + 1)[1:]))
    return _revolved(radii, heights, angle)


def open_bowl(radius_m: float, sections: int = 64, rings: int = 20) -> trimesh.Trimesh:
    """Make the lower half of a sphere, outer surface only."""
    polar = np.linspace(0.05, np.pi / 2, rings + 1)
    return _revolved(
        radius_m * np.sin(polar), radius_m * (1 - np.cos(polar)), 2 * np.pi * np.arange(sections) / sections
    )


def _revolved(radii: np.ndarray, heights: np.ndarray, angle: np.ndarray) -> trimesh.Trimesh:
    rings, sections = len(radii), len(angle)
    ring = np.stack(
        [radii[:, None] * np.cos(angle), radii[:, None] * np.sin(angle), np.repeat(heights[:, None], sections, 1)], -1
    )
    vertices = np.concatenate((ring.reshape(-1, 3), [[0, 0, heights[0]]]))
    i, j = np.meshgrid(np.arange(rings - 1), np.arange(sections), indexing="ij")
    k = (j + 1) % sections
    a, b, c, d = (
        x.ravel() for x in (i * sections + j, i * sections + k, (i + 1) * sections + k, (i + 1) * sections + j)
    )
    spokes = np.arange(sections)
    bottom = np.stack((np.full(sections, rings * sections), (spokes + 1) % sections, spokes), 1)
    faces = np.concatenate((np.stack((a, b, c), 1), np.stack((a, c, d), 1), bottom))
    return trimesh.Trimesh(vertices, faces, process=False)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--damage", nargs="*", default=list(DAMAGES))
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    with (arguments.data / "manifest.csv").open(newline="") as handle:
        files = [row["file"] for row in csv.DictReader(handle) if row["kind"] == "mesh"]
    files = [file for file in files if not arguments.only or file.split("/")[1] in arguments.only]
    originals = {file.split("/")[1]: load(arguments.data / file) for file in files}
    clean = {name: repair(mesh).mesh for name, mesh in originals.items()}
    print(
        "| damage | solid | walls | median / max p95 mm | max error mm | volume off, max % | CPU-s median / max |\n"
        f"|{'---|' * 7}"
    )
    remarks = []
    for damage in arguments.damage:
        rows = []
        for number, (name, mesh) in enumerate(clean.items()):
            rng = np.random.default_rng([arguments.seed, number])
            damaged = DAMAGES[damage](originals[name] if damage == "none" else mesh, rng)
            begun = time.process_time()
            result = repair(damaged)
            seconds = time.process_time() - begun
            p95, worst = error_mm(mesh, result.mesh)
            volume = 100 * abs(result.mesh.volume / mesh.volume - 1)
            rows.append((is_solid(result), result.thickness_m is not None, p95, worst, volume, seconds))
            if not rows[-1][0] or result.thickness_m is not None or p95 > 1 or volume > 5:
                remarks.append(
                    f"{damage} {name}: p95 {p95:.2f} mm, volume off {volume:.1f} %: {'; '.join(result.actions)}"
                )
        solid, walls, p95s, maxima, volumes, cpu = map(np.array, zip(*rows, strict=True))
        print(
            f"| {damage} | {solid.sum()} / {len(rows)} | {walls.sum()} | {np.median(p95s):.2f} / {p95s.max():.2f}"
            f" | {maxima.max():.1f} | {volumes.max():.1f} | {np.median(cpu):.2f} / {cpu.max():.2f} |"
        )
    print("\n".join(remarks))
    print("\n| open sheet | solid | wall mm | volume ml | area x wall ml |\n|---|---|---|---|---|")
    sheets = {
        "cup R40 H100": open_cup(0.04, 0.1), "cup flared R30-45 H90": open_cup(0.03, 0.09, flare=1.5),
        "vase R20 H200": open_cup(0.02, 0.2), "tray R100 H20": open_cup(0.1, 0.02), "bowl R75": open_bowl(0.075),
    }  # fmt: skip
    for name, sheet in sheets.items():
        result = repair(sheet)
        wall = result.thickness_m or 0.0
        print(
            f"| {name} | {is_solid(result)} | {1e3 * wall:.2f} | {1e6 * result.mesh.volume:.1f}"
            f" | {1e6 * wall * sheet.area:.1f} |"
        )


if __name__ == "__main__":
    main()
