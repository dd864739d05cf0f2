"""Score the points that ``rules`` chooses against the parts of templates, which are known by construction.

    python benchmarks/points.py [--seeds N] [--every K] [--held-out]

The annotator gets the mesh and the category's name, 42 candidates of which all count as seen, and none of the known points. A
point is right where its candidate lies on a part that its label speaks of (``PARTS_OF``), or within 3 % of the object's longest
side of one: a candidate is rarely on a thin rim. Labels that speak of none of a template's parts are not judged, and counted.
Categories are split in halves by their order in the alphabet; ``--held-out`` scores the second half, by which nothing is set.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter

import numpy as np
import trimesh

from manitwin.geometry.distance import distance_to_surface
from manitwin.geometry.sampling import farthest_point_sampling, sample_surface
from manitwin.models.annotators.protocol import PointsRequest, Subject
from manitwin.models.annotators.rules import RulesAnnotator
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.known import mass_properties
from manitwin.models.generators.templates.made import Made, make, visual_parts
from manitwin.models.generators.templates.text import read_text

CANDIDATES, SAMPLES = 42, 4000
NEAR_SHARE = 0.03
MAX_OPENING_M = 0.08
PARTS_OF: dict[str, tuple[str, ...]] = {
    "opening": ("rim", "inside", "mouth"), "inside": ("inside",), "rim": ("rim",), "cooking surface": ("inside",),
    "surface": ("inside", "top"), "handle": ("handle",), "handles": ("handle",), "handle end": ("handle",),
    "base": ("base",), "foot": ("foot",), "stem": ("stem",), "neck": ("neck",), "cap": ("cap",),
    "lid": ("cap", "lid", "top", "tab", "wick", "pole"), "spout": ("spout",), "blade": ("blade", "edge"),
    "tip": ("tip", "lead", "wood", "blade", "edge"), "bristles": ("bristles",), "jaw": ("jaw", "jaws", "mouth"),
    "jaws": ("jaw", "jaws", "mouth"), "joint": ("joint",), "striking face": ("face", "edge"),
    "head": ("head", "face", "claw", "blade", "bowl", "inside", "jaw", "pan", "edge"), "front edge": ("edge", "inside", "pan"),
    "working end": ("outlet",), "ear cup": ("cups",), "headband": ("band",), "inner side": ("bore", "hole", "band"),
    "outer side": ("teeth", "body", "band"), "core": ("core",), "shaft": ("shaft", "blade", "body"),
    "barrel": ("barrel",), "cap end": ("eraser", "button", "ferrule", "cap"),
}  # fmt: skip
"""Which parts of templates a label of the priors' forms speaks of."""


def main() -> None:
    """Print the score, and what went wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--every", type=int, default=1, help="every Kth category")
    parser.add_argument("--held-out", action="store_true")
    arguments = parser.parse_args()
    categories = sorted(load_templates())[1 if arguments.held_out else 0 :: 2][:: arguments.every]
    judged, right, skipped, wrong = 0, 0, 0, Counter[str]()
    whole, started = set(categories), time.process_time()
    for category in categories:
        for seed in range(arguments.seeds):
            for label, part, verdict in verdicts(category, seed):
                skipped += verdict is None
                judged += verdict is not None
                right += verdict is True
                if verdict is False:
                    wrong[f"{category}: {label} on {part}"] += 1
                    whole.discard(category)
    seconds = (time.process_time() - started) / (len(categories) * arguments.seeds)
    print(f"{len(categories)} categories x {arguments.seeds} seeds, {seconds:.2f} CPU-s each")
    print(f"{right} of {judged} points on the right part ({100 * right / judged:.1f} %), {skipped} not judged")
    print(f"{len(whole)} categories without a wrong point")
    for line, count in wrong.most_common():
        print(f"  {count} x {line}")


def verdicts(category: str, seed: int) -> list[tuple[str, str, bool | None]]:
    """Return of each functional point its label, the part that its candidate lies on, and whether that is right."""
    templates = load_templates()
    made = make(templates[category], read_text(category, templates), np.random.default_rng(seed))
    solid = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
    points, normals, faces = sample_surface(solid, SAMPLES, np.random.default_rng(seed))
    chosen = farthest_point_sampling(points, CANDIDATES, 0)
    subject = Subject(
        name=category, solid=solid, parts=tuple(visual_parts(made)), metric=True, views=(), cameras=(), seed=seed
    )
    center_of_mass_m = mass_properties(made.solids)[1]
    request = PointsRequest(subject, points[chosen], normals[chosen], (), (), center_of_mass_m, MAX_OPENING_M)
    rows = []
    for point in RulesAnnotator().select_points(request).functional:
        part = made.mesh.names[made.mesh.part[faces[chosen[point.candidate]]]]
        rows.append((point.label, part, _right(made, point.label, part, points[chosen[point.candidate]])))
    return rows


def _right(made: Made, label: str, part: str, position_m: np.ndarray) -> bool | None:
    meant = [name for name in PARTS_OF.get(label, ()) if name in made.mesh.names and len(made.mesh.faces_of(name))]
    if not meant:
        return None
    if part in meant:
        return True
    faces = made.mesh.faces[np.isin(made.mesh.part, [made.mesh.names.index(name) for name in meant])]
    meant_surface = trimesh.Trimesh(made.mesh.vertices, faces, process=False)
    distance_m = float(distance_to_surface(position_m[None], meant_surface)[0])
    return distance_m <= NEAR_SHARE * float(np.ptp(made.mesh.vertices, axis=0).max())


if __name__ == "__main__":
    main()
