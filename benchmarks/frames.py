"""Score frames found by geometry against those of templates, which are known by construction.

    python benchmarks/frames.py [--seeds N] [--every K] [--held-out] [--pictures FOLDER]

A frame is asked for at the candidate nearest to the known point on its part (of 42 candidates by farthest point sampling), with
the known point's label and no other knowledge of the template. The categories are split in halves by the CRC-32 of their names,
as in ``points.py``; no parameter is set with the ``--held-out`` half. A frame is right within the stated limits, absent where the
geometry is judged unclear, of another kind where the label may mean several kinds (a "base" is a face), and wrong otherwise.

Holes are compared by the lines of their axes, because the choice of the end of a bore is a convention. Tips are compared by their
ends, which may be as broad as the frame states.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter, defaultdict

import numpy as np
import trimesh
from points import CANDIDATES, SAMPLES, held_out

from manitwin.geometry.frames.feature import FeatureFrame, FramedMesh
from manitwin.geometry.frames.find import find_frame
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.geometry.sampling import farthest_point_sampling, sample_surface
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.ground_truth import mass_properties
from manitwin.models.generators.templates.known_frames import known_frame
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.models.generators.templates.template import KnownPoint
from manitwin.models.generators.templates.template_object import TemplateObject

BARS = {
    "opening": (0.005, 3.0),
    "face": (0.003, 3.0),
    "hole": (0.002, 5.0),
    "edge": (0.010, 10.0),
    "tip": (0.005, 10.0),
    "button": (0.003, 10.0),
}
"""Largest position error (m) and angle error (degrees) of a right frame, by kind; the angle of an edge is that of its line."""


def main() -> None:
    """Print the score of each kind, and the wrong frames."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--every", type=int, default=1, help="every Kth category")
    parser.add_argument("--held-out", action="store_true")
    parser.add_argument("--kind", choices=sorted(BARS))
    arguments = parser.parse_args()
    half = [name for name in sorted(load_templates()) if held_out(name) == arguments.held_out][:: arguments.every]
    counts, lines = defaultdict(Counter[str]), []
    errors: dict[str, list[tuple[float, float]]] = defaultdict(list)
    seconds, asked = 0.0, 0
    for category in half:
        for seed in range(arguments.seeds):
            templates = load_templates()
            made = make_object(templates[category], read_text(category, templates), np.random.default_rng(seed))
            rows, spent = score(made, seed, arguments.kind)
            seconds, asked = seconds + spent, asked + bool(rows)
            for kind, verdict, line, off in rows:
                counts[kind][verdict] += 1
                if off is not None:
                    errors[kind].append(off)
                if verdict != "right":
                    lines.append(f"  {kind:8} {verdict:7} {category}: {line}")
    for kind, count in sorted(counts.items()):
        total = count.total()
        off = np.array(errors[kind] or [(np.nan, np.nan)])
        print(
            f"{kind:8} {total:4} asked: right {count['right']} ({100 * count['right'] / total:.0f} %), wrong "
            f"{count['wrong']}, absent {count['absent']}, another kind {count['other']}; "
            f"of those found, median {1000 * np.median(off[:, 0]):.1f} mm "
            f"and {np.median(off[:, 1]):.1f} degrees"
        )
    print(f"{seconds / max(asked, 1):.3f} CPU-s a thing")
    for line, count in sorted(Counter(lines).items()):
        print(f"{count} x{line}")


def score(
    made: TemplateObject, seed: int, kind: str | None
) -> tuple[list[tuple[str, str, str, tuple[float, float] | None]], float]:
    """Return kind, verdict, text and error of the frame at each known point, and the CPU seconds."""
    solid = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
    points, normals, faces = sample_surface(solid, SAMPLES, np.random.default_rng(seed))
    chosen = farthest_point_sampling(points, CANDIDATES, 0)
    part = made.mesh.part[faces]
    center = mass_properties(made.solids)[1]
    rows = []
    started = time.process_time()
    surface = FramedMesh(solid, center, seed)
    for known in made.points:
        if known.kind not in BARS or (kind is not None and known.kind != kind):
            continue
        at = candidate_of(made, known, points, part, chosen)
        found = find_frame(surface, points[at], normals[at], known.label)
        rows.append((known.kind, *judged(made, known, center, found)))
    return rows, time.process_time() - started


def candidate_of(
    made: TemplateObject, known: KnownPoint, points: np.ndarray, part: np.ndarray, chosen: np.ndarray
) -> int:
    """Return the nearest candidate on a known point's part, or else the nearest surface sample of the part."""
    mine = np.flatnonzero(part == made.mesh.names.index(known.part))
    own = np.intersect1d(mine, chosen)
    pool = own if len(own) else (mine if len(mine) else chosen)
    return int(pool[np.linalg.norm(points[pool] - known.position_m, axis=1).argmin()])


def judged(
    made: TemplateObject, known: KnownPoint, center: np.ndarray, found: object
) -> tuple[str, str, tuple[float, float] | None]:
    """Return the verdict on a frame, a text, and its error (m, degrees)."""
    name = f"{known.label} [{known.part}]"
    if not isinstance(found, FeatureFrame):
        return "absent", f"{name}: {getattr(found, 'reason', '')}", None
    truth = known_frame(made, known, center)
    rotation = rotation_from_quaternion_wxyz(np.array(truth.quaternion_wxyz))
    offset = found.position_m - np.array(truth.position_m)
    if found.kind != known.kind:
        return "other", f"{name}: a {found.kind}, which the label may mean too", None
    compared = 0 if known.kind == "edge" else 2
    cosine = float(found.rotation[:, compared] @ rotation[:, compared])
    if known.kind in ("hole", "edge"):
        cosine = abs(cosine)
    if known.kind == "hole":
        offset = offset - (offset @ rotation[:, 2]) * rotation[:, 2]
    if known.kind == "edge":
        offset = offset - (offset @ rotation[:, 0]) * rotation[:, 0]
    if known.kind == "tip":  # any point across the end is as good as its middle
        along = float(offset @ rotation[:, 2])
        across = float(np.linalg.norm(offset - along * rotation[:, 2]))
        offset = np.array([along, max(0.0, across - max(truth.size_m, found.size_m)), 0.0])
    away, angle = float(np.linalg.norm(offset)), float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    turned = ""
    if known.kind == "opening" and truth.free == "none" and not found.roll_free:
        roll = np.degrees(np.arccos(np.clip(found.x @ rotation[:, 0], -1, 1)))
        turned = f", pour direction {roll:.0f} degrees off" if roll > 15 else ""
    right = away <= BARS[known.kind][0] and angle <= BARS[known.kind][1]
    return "right" if right else "wrong", f"{name}: {1000 * away:.0f} mm, {angle:.0f} degrees{turned}", (away, angle)


if __name__ == "__main__":
    main()
