"""Score the points that ``rules`` chooses against the parts of templates, which are known by construction.

    python benchmarks/points.py [--seeds N] [--every K] [--held-out]

The annotator gets the mesh and the category's name, 42 candidates of which all count as seen, and none of the known points. A
point is right where its candidate lies where its label says, by the template's parts and frame (``known_places``). Labels that
name no place of a thing are not judged, counted, and listed. Categories are split in halves by the CRC-32 of their names;
``--held-out`` scores the half by which nothing is set.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from zlib import crc32

import numpy as np
import trimesh
from known_places import Known

from manitwin.geometry.sampling import farthest_point_sampling, sample_surface
from manitwin.models.annotators.protocol import PointsRequest, Subject
from manitwin.models.annotators.rules import RulesAnnotator
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.known import mass_properties
from manitwin.models.generators.templates.made import make, visual_parts
from manitwin.models.generators.templates.text import read_text

CANDIDATES, SAMPLES = 42, 4000
MAX_OPENING_M = 0.08


def main() -> None:
    """Print the score, and what went wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--every", type=int, default=1, help="every Kth category")
    parser.add_argument("--held-out", action="store_true")
    arguments = parser.parse_args()
    half = [name for name in sorted(load_templates()) if held_out(name) == arguments.held_out]
    categories = half[:: arguments.every]
    judged, right, skipped, wrong = 0, 0, Counter[str](), Counter[str]()
    whole, started = set(categories), time.process_time()
    for category in categories:
        for seed in range(arguments.seeds):
            for label, part, verdict in verdicts(category, seed):
                skipped[f"{category}: {label}"] += verdict is None
                judged += verdict is not None
                right += verdict is True
                if verdict is False:
                    wrong[f"{category}: {label} on {part}"] += 1
                    whole.discard(category)
    seconds = (time.process_time() - started) / (len(categories) * arguments.seeds)
    print(f"{len(categories)} categories x {arguments.seeds} seeds, {seconds:.2f} CPU-s each")
    print(f"{right} of {judged} points on the right part ({100 * right / judged:.1f} %), {skipped.total()} not judged")
    print(f"{len(whole)} categories without a wrong point")
    for line, count in wrong.most_common():
        print(f"  {count} x {line}")
    print("not judged: " + "; ".join(f"{count} x {line}" for line, count in skipped.items() if count))


def held_out(category: str) -> bool:
    """Tell which half a category is in."""
    return crc32(category.encode()) % 2 == 1


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
    known, rows = Known.of(made), []
    for point in RulesAnnotator().select_points(request).functional:
        part = made.mesh.names[made.mesh.part[faces[chosen[point.candidate]]]]
        verdict = known.right(point.label, point.candidate, points[chosen], normals[chosen])
        rows.append((point.label, part, verdict))
    return rows


if __name__ == "__main__":
    main()
