"""Make many inputs from few: every mesh and photo of a data folder, repeated with small seeded variations.

    python benchmarks/vary.py DATA OUT [--count 500] [--seed 0]

Meshes are scaled by 0.92 to 1.08, by a further 3 % at most along each axis, and rotated about the vertical. Photos are scaled by
0.85 to 1, mirrored or not, and brightened by at most 6 %. The first of each is the original. Writes OUT/items.csv.
"""

from __future__ import annotations

import argparse
import csv
from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image, ImageEnhance, ImageOps

from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.read import read_mesh

TEXTURE_PX = 512
SPDX = {
    "CC BY 4.0": "CC-BY-4.0",
    "BSD-3-Clause": "BSD-3-Clause",
    "MIT": "MIT",
    "Apache-2.0": "Apache-2.0",
    "CC0": "CC0-1.0",
}


def main() -> None:
    """Write the inputs and their manifest."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    with (arguments.data / "manifest.csv").open(newline="") as stream:
        rows = [row for row in csv.DictReader(stream) if row["kind"] in ("mesh", "photo")]
    arguments.out.mkdir(parents=True, exist_ok=True)
    items = []
    for source, row in enumerate(rows):  # source by source, so that each mesh is read once
        for number in range(source, arguments.count, len(rows)):
            rng = np.random.default_rng([arguments.seed, number])
            file = vary(arguments.data / row["file"], row["kind"], arguments.out, number, number < len(rows), rng)
            units = "m" if row["kind"] == "mesh" else "auto"
            items.append((number, [str(file), row["category"], units, spdx(row["licence"]), row["source"]]))
    with (arguments.out / "items.csv").open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["file", "name", "units", "license", "attribution"])
        writer.writerows(row for _, row in sorted(items))


def vary(path: Path, kind: str, out: Path, number: int, original: bool, rng: np.random.Generator) -> Path:
    """Write one variation and return its path; the original stays where it is."""
    if original:
        return path.resolve()
    name = path.parent.name if kind == "mesh" else path.stem
    target = (out / f"{number:04d}_{name}").with_suffix(".glb" if kind == "mesh" else ".jpg").resolve()
    if kind == "mesh":
        target.write_bytes(write_glb(varied_parts(path, rng), max_texture_size=TEXTURE_PX))
        return target
    with Image.open(path) as image:
        photo = ImageOps.exif_transpose(image).convert("RGB")
    scale = rng.uniform(0.85, 1.0)
    photo = photo.resize((round(photo.width * scale), round(photo.height * scale)), Image.Resampling.LANCZOS)
    photo = ImageOps.mirror(photo) if rng.random() < 0.5 else photo
    ImageEnhance.Brightness(photo).enhance(rng.uniform(0.94, 1.06)).save(target, quality=93)
    return target


def varied_parts(path: Path, rng: np.random.Generator) -> list[trimesh.Trimesh]:
    """Return the mesh's parts, Y-up in metres, scaled and rotated."""
    parts, up = parts_of(path)
    scale = rng.uniform(0.92, 1.08) * rng.uniform(0.97, 1.03, 3)
    turn = trimesh.transformations.rotation_matrix(rng.uniform(0, 2 * np.pi), [0, 1, 0])
    upright = np.eye(4) if up == "y" else trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0])
    matrix = turn @ np.diag([*scale, 1.0]) @ upright
    moved = [part.copy() for part in parts]
    for part in moved:
        part.apply_transform(matrix)
    return moved


@lru_cache(maxsize=1)
def parts_of(path: Path) -> tuple[list[trimesh.Trimesh], str]:
    """Return the parts of a mesh file in metres, and its up axis; meshes that declare none are Z-up."""
    mesh = read_mesh(path)
    for part in mesh.parts:
        part.apply_scale(mesh.unit_m or 1.0)
    return mesh.parts, mesh.up or "z"


def spdx(licence: str) -> str:
    """Return the SPDX id of a licence in words, or ``unknown`` if it has no single one."""
    return next((found for words, found in SPDX.items() if words in licence), "unknown")


if __name__ == "__main__":
    main()
