"""Build objects from photos of scanned objects, whose known shape is that of no template, and print the accuracy.

    python benchmarks/scanned_photos.py TWINS OUT [--own-matte]

TWINS are accepted twins with names, from scans or models that were not made for this project (``manitwin build`` with a manifest
of names). Each is photographed at three elevations and built from the photo under its name, as ``photo_generation`` does with
templates. The true mask is used, to judge the shape alone, or with ``--own-matte`` the mask of the matting stage. OUT receives
photos, meshes and ``results.csv``.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from photo_generation import Result, build, families, summary_reasons, table, write_results
from template_photos import photographed

from manitwin.twin.mesh_files import read_visual
from manitwin.twin.store import read_record

SEED = 1


@dataclass(frozen=True)
class ScannedPhoto:
    """A photo with its truth, like ``TemplatePhoto``; ``truth`` is the object's surface in its frame, metres."""

    rgb: np.ndarray
    mask: np.ndarray
    truth: trimesh.Trimesh
    elevation_deg: float
    ground: str


def standing(parts: list[trimesh.Trimesh]) -> list[trimesh.Trimesh]:
    """Return the parts of an object in its frame, shifted vertically so that the lowest point is at z = 0."""
    low_m = min(float(part.vertices[:, 2].min()) for part in parts)
    return [part.copy().apply_translation([0.0, 0.0, -low_m]) for part in parts]


def main() -> None:
    """Photograph, build, compare and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("twins", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--own-matte", action="store_true")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    how = argparse.Namespace(truth_matte=not options.own_matte, nameless=False)
    results: list[Result] = []
    for folder in sorted(path.parent for path in options.twins.glob("twins/*/*/twin.json")):
        twin = read_record(folder)
        if twin.status != "accepted" or twin.name is None:
            continue
        parts = standing(read_visual(folder / "visual.glb"))
        truth = trimesh.util.concatenate([trimesh.Trimesh(x.vertices, x.faces, process=False) for x in parts])
        for shot in photographed(parts, np.random.default_rng([SEED, *folder.name.encode()])):
            path = options.out / f"{twin.name.replace(' ', '_')}-{folder.name[:6]}-{shot.seen_from[0]:.0f}.png"
            photo = ScannedPhoto(shot.rgb, shot.mask, truth, shot.seen_from[0], shot.ground)
            result = build(photo, twin.name, SEED, path, how)
            results.append(result)
            print(f"{path.name:36s} {result.primitive:24s} {result.filled_iou} {result.reason}", flush=True)
    write_results(results, options.out / "results.csv")
    for by in ("category", "primitive", "elevation_deg"):
        print(table(families(results), by), end="\n\n")
    print(*(f"{count:4d} {reason}" for reason, count in summary_reasons(results)), sep="\n")


if __name__ == "__main__":
    main()
