"""Measure the similarity of near-duplicates and of different objects, from which the limits of ``collect add --alike`` are set.

python benchmarks/alike.py FOLDER [--most N] [--seed N]

Takes the photos and meshes below a folder, which must all show different objects. Each file is altered in the ways in which files
usually change when they are copied, and is compared with its altered copies and with the other files. Prints quantiles of the
similarities and the share of pairs that reach the limit.
"""

from __future__ import annotations

import argparse
import io
from contextlib import suppress
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image, ImageEnhance

from manitwin.dataset.collect.looks import ALIKE, PICTURE, SHAPE, picture_feature, shape_feature, similarity
from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh
from manitwin.formats.source_files import IMAGE_SUFFIXES, MESH_SUFFIXES
from manitwin.render.raycast import merge_parts


def changed_pictures(picture: Image.Image) -> list[Image.Image]:
    """Return altered copies of a picture: smaller, compressed, cropped by 5 %, brighter, and all of these together."""
    width, height = picture.size
    margin = (round(0.025 * width), round(0.025 * height), round(0.975 * width), round(0.975 * height))
    smaller, cropped = picture.resize((width // 2, height // 2)), picture.crop(margin)
    brighter = ImageEnhance.Brightness(picture).enhance(1.1)
    return [smaller, compressed(picture, 50), cropped, brighter, compressed(brighter.crop(margin), 70)]


def compressed(picture: Image.Image, quality: int) -> Image.Image:
    """Return a picture after JPEG compression with the given quality (1 to 95)."""
    stream = io.BytesIO()
    picture.save(stream, "JPEG", quality=quality)
    return Image.open(stream).convert("RGB")


def changed_meshes(mesh: trimesh.Trimesh, rng: np.random.Generator) -> list[trimesh.Trimesh]:
    """Return altered copies of a mesh: rotated and in millimetres, subdivided, and with rounded vertices."""
    turned = mesh.copy()
    turned.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
    turned.apply_scale(1000.0)
    finer = mesh.subdivide()
    step_m = float(mesh.extents.max()) / 500
    return [turned, finer, trimesh.Trimesh(np.round(mesh.vertices / step_m) * step_m, mesh.faces, process=False)]


def told(name: str, values: list[float], bar: float) -> None:
    """Print quantiles of similarities and the share of them that reaches ``bar``."""
    found = np.array(values)
    low, middle, high = np.quantile(found, [0.05, 0.5, 0.95])
    share = (found >= bar).mean()
    print(
        f"{name}: {len(found)}, 5/50/95 %: {low:.4f} {middle:.4f} {high:.4f}, most {found.max():.4f}; {share:.1%} at {bar}"
    )


def main() -> None:
    """Measure the similarities and print them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--most", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    files = sorted(file for file in arguments.folder.rglob("*") if file.is_file())
    photos = drawn([file for file in files if file.suffix.lower() in IMAGE_SUFFIXES], arguments.most, rng)
    pictures = [Image.open(file).convert("RGB") for file in photos]
    looks = np.array([picture_feature(np.asarray(picture)) for picture in pictures])
    same = [
        float(picture_feature(np.asarray(each)) @ look)
        for picture, look in zip(pictures, looks, strict=True)
        for each in changed_pictures(picture)
    ]
    told("pictures changed", same, ALIKE[PICTURE])
    told("other pictures", (looks @ looks.T)[np.tril_indices(len(looks), -1)].tolist(), ALIKE[PICTURE])
    meshes = []
    for file in drawn([file for file in files if file.suffix.lower() in MESH_SUFFIXES], arguments.most, rng):
        with suppress(InputError):
            meshes.append(merge_parts(read_mesh(file).parts))
    shapes = np.array([shape_feature(mesh) for mesh in meshes])
    kept = [
        float(similarity(shape, shape_feature(each)[None], SHAPE)[0])
        for mesh, shape in zip(meshes, shapes, strict=True)
        for each in changed_meshes(mesh, rng)
    ]
    told("meshes changed", kept, ALIKE[SHAPE])
    others = [float(v) for n in range(1, len(shapes)) for v in similarity(shapes[n], shapes[:n], SHAPE)]
    told("other meshes", others, ALIKE[SHAPE])


def drawn(files: list[Path], most: int, rng: np.random.Generator) -> list[Path]:
    """Return at most ``most`` files, drawn at random, in the order of ``files``."""
    return [files[place] for place in sorted(rng.permutation(len(files))[:most])]


if __name__ == "__main__":
    main()
