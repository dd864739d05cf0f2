"""Score the points chosen by ``rules`` against the parts of templates, which are known by construction.

    python benchmarks/points.py [--first SEED] [--seeds N] [--every K] [--held-out | --later] [--plain]

The annotator is given the mesh, the category's name and 42 candidates that all count as visible, but none of the known points. A
point is right if its candidate lies where its label belongs, by the template's parts and frame (``known_places``). Labels that
name no place of an object are not judged, but counted and listed. The first 127 categories are split in halves by the CRC-32 of
their names. ``--held-out`` scores the half with which no parameter is set, ``--later`` the categories whose templates were added
afterwards.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from zlib import crc32

import numpy as np
import trimesh
from composite_categories import COMPOSITE_CATEGORIES
from known_places import Known

from manitwin.geometry.candidate_sampling import sample_candidates
from manitwin.geometry.cavity import find_opening
from manitwin.geometry.frames.feature import FramedMesh
from manitwin.geometry.sampling import farthest_point_sampling, sample_surface
from manitwin.models.annotators.protocol import PointsRequest, Subject
from manitwin.models.annotators.rules import RulesAnnotator
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.ground_truth import mass_properties
from manitwin.models.generators.templates.known_frames import known_frame
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.models.generators.templates.template_object import TemplateObject, visual_parts
from manitwin.pipeline.frames import with_frames
from manitwin.pipeline.refinement import away_from_feature_m, refined_points
from manitwin.twin.point_records import FunctionalPoint

CANDIDATES, SAMPLES = 42, 8000
MAX_OPENING_M = 0.08


def main() -> None:
    """Print the score, and the wrong points."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--every", type=int, default=1, help="every Kth category")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--held-out", action="store_true")
    which.add_argument("--later", action="store_true")
    parser.add_argument(
        "--plain", action="store_true", help="candidates by farthest point sampling alone, no closer look"
    )
    arguments = parser.parse_args()
    half = [name for name in COMPOSITE_CATEGORIES if held_out(name) == arguments.held_out]
    later = sorted(load_templates().keys() - set(COMPOSITE_CATEGORIES))
    categories = (later if arguments.later else half)[:: arguments.every]
    judged, right, skipped, wrong = 0, 0, Counter[str](), Counter[str]()
    away: list[float] = []
    whole, started = set(categories), time.process_time()
    for category in categories:
        for seed in range(arguments.first, arguments.first + arguments.seeds):
            for label, part, verdict, off_m in verdicts(category, seed, arguments.plain):
                away += [off_m] if off_m is not None else []
                skipped[f"{category}: {label}"] += verdict is None
                judged += verdict is not None
                right += verdict is True
                if verdict is False:
                    wrong[f"{category}: {label} on {part}"] += 1
                    whole.discard(category)
    seconds = (time.process_time() - started) / (len(categories) * arguments.seeds)
    print(f"{len(categories)} categories x {arguments.seeds} seeds, {seconds:.2f} CPU-s each")
    print(f"{right} of {judged} points on the right part ({100 * right / judged:.1f} %), {skipped.total()} not judged")
    shown = np.quantile(away, (0.5, 0.75, 0.9)) * 1000
    print(
        f"{len(away)} points of known features: {shown[0]:.1f} mm from them in the median, {shown[1]:.1f} mm for three of four,"
        f" {shown[2]:.1f} mm for nine of ten, {1000 * np.mean(away):.1f} mm in the mean"
    )
    print(f"{len(whole)} categories without a wrong point")
    for line, count in wrong.most_common():
        print(f"  {count} x {line}")
    print("not judged: " + "; ".join(f"{count} x {line}" for line, count in skipped.items() if count))


def held_out(category: str) -> bool:
    """Tell whether a category is in the held-out half."""
    return crc32(category.encode()) % 2 == 1


def verdicts(category: str, seed: int, plain: bool) -> list[tuple[str, str, bool | None, float | None]]:
    """Return for each functional point its label, the part of its candidate, whether it is right, and the distance of its
    feature.
    """
    templates = load_templates()
    made = make_object(templates[category], read_text(category, templates), np.random.default_rng(seed))
    solid = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
    points, normals, faces = sample_surface(solid, SAMPLES, np.random.default_rng(seed))
    if plain:
        chosen = farthest_point_sampling(points, CANDIDATES, 0)
    else:
        chosen = sample_candidates(points, normals, CANDIDATES, find_opening(solid))
    subject = Subject(
        name=category, solid=solid, parts=tuple(visual_parts(made)), metric=True, views=(), cameras=(), seed=seed
    )
    center_of_mass_m = mass_properties(made.solids)[1]
    request = PointsRequest(subject, points[chosen], normals[chosen], (), (), center_of_mass_m, MAX_OPENING_M)
    known, rows = Known.of(made), []
    selected = RulesAnnotator().select_points(request)
    functional = list(selected.functional)
    positions_m, outward = points[chosen], normals[chosen]
    if not plain:
        surface = FramedMesh(solid, center_of_mass_m, seed)
        functional, _ = refined_points(
            with_frames(functional, surface)[0],
            surface,
            {point.candidate for point in selected.grasp},
            lambda place: True,
        )
    for point in functional:
        positions_m[point.candidate], outward[point.candidate] = point.position_m, point.normal
        part = made.mesh.names[made.mesh.part[faces[chosen[point.candidate]]]]
        verdict = known.right(point.label, point.candidate, positions_m, outward)
        rows.append((point.label, part, verdict, away_m(made, point, center_of_mass_m)))
    return rows


def away_m(made: TemplateObject, point: FunctionalPoint, center_of_mass_m: np.ndarray) -> float | None:
    """Return the distance (m) of a point from the known feature of its label, or None if the template has none."""
    features = [known for known in made.points if known.label == point.label and known.kind not in ("surface", "axis")]
    frames = [known_frame(made, known, center_of_mass_m) for known in features]
    place = np.array(point.position_m)[None]
    return min((float(away_from_feature_m(frame, place)[0]) for frame in frames), default=None)


if __name__ == "__main__":
    main()
