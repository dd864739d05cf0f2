"""Score the parts recognised by shape against the parts of templates, which are known by construction.

    python benchmarks/parts.py [--first SEED] [--seeds N] [--held-out] [--every K] [--rules NAME,NAME]

The surface is segmented by the shape rule of its category alone, without the template's own parts. ``Clean`` is the mesh as
built. ``Rough`` has its edges subdivided to 1/40 of the size, is smoothed by 15 rounds of Taubin's filter and has 0.3 mm of
noise, like meshes from scans and generators. The truth of a part is the union of the template's finer parts that ``TRUE_ROLES``
assigns to its role. The score of an object is the mean intersection over union by area of its true and recognised parts. Objects
for which the rule recognises no parts are counted separately and not scored. The categories are split into the halves of
``points.py``; no parameter is set with the held-out half.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import trimesh
from points import held_out
from scipy.spatial import cKDTree

from manitwin.geometry.parts.edge_subdivision import subdivide_long_edges
from manitwin.geometry.parts.membership import PartRule
from manitwin.geometry.parts.segmentation import segment_by_rule
from manitwin.geometry.parts.shape import measure_shape
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.object_sampling import make_object

TRUE_ROLES: dict[PartRule, tuple[str, dict[str, str]]] = {
    "handled": ("body", {"handle": "handle", "grips": "handle"}),
    "spouted": ("body", {"handle": "handle", "spout": "spout"}),
    "capped": ("body", dict.fromkeys(("cap", "collar", "stem", "head", "spout", "nozzle", "trigger", "holes"), "cap")),
    "stemmed": ("bowl", {"stem": "stem", "foot": "foot"}),
    "ended": ("head", {"handle": "handle", "neck": "neck", "bow": "handle", "hole": "handle"}),
    "pistol": ("housing", {"handle": "grip", "switch": "grip"}),
    "open": ("body", {"inside": "inside", "rim": "rim", "base": "base", "underside": "base", "knob": "body"}),
    "closed": ("body", {"top": "top", "base": "base"}),
    "arched": ("band", {"cups": "cup"}),
    "sectioned": ("shaft", {}),
}
"""For each rule the role of parts not named here, and the roles of those named. Faces of flat objects are no template parts."""
SECTIONS = {
    "allen key": {},
    "battery": {"pole": "tip"},
    "chopstick": {"tip": "tip"},
    "electric toothbrush": {"neck": "tip", "head": "tip", "bristles": "tip"},
    "light bulb": {"base": "tip"},
    "marker": {"cap": "tip", "clip": "tip"},
    "pen": {"tip": "tip"},
    "pencil": {"wood": "tip", "lead": "tip", "ferrule": "end", "eraser": "end"},
    "rolling pin": {"handle": "tip"},
    "toothpaste": {"cap": "tip"},
    "umbrella": {"handle": "end"},
    "wrench": {"jaw": "tip", "ring": "end", "hole": "end"},
}
"""Sections of long objects by category; everything else is the shaft.

A recognised section counts as the most similar true one, because which of them is called the shaft is a convention. An allen key
is one bent bar: no part of the template begins where its arms meet.
"""
RIM_M, RIM_SHARE = 0.018, 0.4
"""A rim is the area that a finger pad covers on both sides of the template's rim, at most this share of height or radius."""
CLEAN_BAR, ROUGH_BAR = 0.88, 0.78


def main() -> None:
    """Print the score of each category, and the means."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--every", type=int, default=1, help="every Kth category")
    parser.add_argument("--held-out", action="store_true")
    parser.add_argument("--rules", help="only categories of these rules")
    arguments = parser.parse_args()
    half = [name for name in sorted(load_templates()) if held_out(name) == arguments.held_out]
    ruled = [name for name in half if scored(name)]
    if arguments.rules:
        ruled = [name for name in ruled if find_prior(name).parts in arguments.rules.split(",")]  # type: ignore[union-attr]
    found: dict[bool, list[float | None]] = {False: [], True: []}
    started = time.process_time()
    for category in ruled[:: arguments.every]:
        words = []
        for rough in (False, True):
            scores = [
                score(category, seed, rough) for seed in range(arguments.first, arguments.first + arguments.seeds)
            ]
            found[rough] += scores
            words.append(" ".join("  - " if value is None else f"{value:.2f}" for value in scores))
        print(f"{category:18s} clean {words[0]}   rough {words[1]}", flush=True)
    seconds = (time.process_time() - started) / len(found[False] + found[True])
    print(f"{len(ruled)} of {len(half)} categories have a rule; {seconds:.2f} CPU-s each, making them included")
    for rough, bar in ((False, CLEAN_BAR), (True, ROUGH_BAR)):
        told = np.array([value for value in found[rough] if value is not None])
        print(
            f"{'rough' if rough else 'clean'}: mean IoU {told.mean():.3f} (bar {bar}), worst {told.min():.2f}, "
            f"{(told < 0.7).sum()} of {len(told)} under 0.7, {len(found[rough]) - len(told)} not told"
        )


def scored(category: str) -> bool:
    """Tell whether the template's parts have the borders of the rule; a flashlight's head and barrel are one part."""
    prior, templates = find_prior(category), load_templates()
    if prior is None or prior.parts not in TRUE_ROLES:
        return False
    if prior.parts == "sectioned":
        return bool(SECTIONS.get(category))
    rest, roles = TRUE_ROLES[prior.parts]
    names = make_object(templates[category], read_text(category, templates), np.random.default_rng(0)).mesh.names
    return len({roles.get(name, rest) for name in names}) > 1


def score(category: str, seed: int, rough: bool) -> float | None:
    """Return the mean IoU of an object's parts, or None where none are recognised."""
    templates, prior = load_templates(), find_prior(category)
    assert prior is not None and prior.parts is not None
    made = make_object(templates[category], read_text(category, templates), np.random.default_rng(seed))
    mesh, part = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False), made.mesh.part
    if rough:
        mesh, part = roughened(mesh, part)
    shape = measure_shape(mesh, mesh.center_mass, prior.head_end, prior.stands, np.random.default_rng(seed))
    told = segment_by_rule(mesh, shape, prior.parts)
    if told is None:
        return None
    rest, roles = TRUE_ROLES[prior.parts]
    roles = SECTIONS.get(category, roles) if prior.parts == "sectioned" else roles
    truth = np.array([roles.get(name, rest) for name in made.mesh.names])[part]
    if prior.parts == "open":
        truth = with_rim(mesh, truth)
    answer, areas = np.array(told.roles)[told.role], np.asarray(mesh.area_faces)
    if prior.parts == "sectioned":
        answer = by_best_match(answer, truth, areas)
    answer = np.where(np.isin(answer, [rest, *roles.values()]), answer, rest)
    if prior.parts in ("open", "closed") and not np.isin(("base", "underside"), made.mesh.names).any():
        answer = np.where(answer == "base", rest, answer)  # the template has one part for base and wall
    each = [
        areas[(answer == role) & (truth == role)].sum() / areas[(answer == role) | (truth == role)].sum()
        for role in np.union1d(truth, answer)
    ]
    return float(np.mean(each))


def by_best_match(answer: np.ndarray, truth: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """Return for each recognised section the true one with the highest intersection over union."""
    names, matched = np.unique(truth), answer.copy()
    for told in np.unique(answer):
        mine = answer == told
        match = [areas[mine & (truth == name)].sum() / areas[mine | (truth == name)].sum() for name in names]
        matched[mine] = names[int(np.argmax(match))]
    return matched


def with_rim(mesh: trimesh.Trimesh, truth: np.ndarray) -> np.ndarray:
    """Return the roles of a container's faces; faces mostly near its rim get the role of the rim."""
    rim = np.asarray(mesh.triangles_center)[truth == "rim"]
    if not len(rim):
        return truth
    reach_m = min(RIM_M, RIM_SHARE * max(float(mesh.extents[2]), float(np.ptp(rim, axis=0)[:2].max()) / 2))
    vertices, faces, of_face = subdivide_long_edges(
        mesh.vertices, mesh.faces, min(reach_m / 3, float(mesh.extents.max()) / 40)
    )
    pieces = trimesh.Trimesh(vertices, faces, process=False)
    centers = np.asarray(pieces.triangles_center)
    within = cKDTree(centers[truth[of_face] == "rim"]).query(centers)[0] <= reach_m
    near = np.bincount(of_face, pieces.area_faces * within, len(mesh.faces)) > 0.5 * np.asarray(mesh.area_faces)
    return np.where(near & np.isin(truth, ["body", "inside"]), "rim", truth)


def roughened(mesh: trimesh.Trimesh, part: np.ndarray) -> tuple[trimesh.Trimesh, np.ndarray]:
    """Return a mesh like those of scans and generators, with the part of each face."""
    vertices, faces, of_face = subdivide_long_edges(mesh.vertices, mesh.faces, float(mesh.extents.max()) / 40)
    fine = trimesh.smoothing.filter_taubin(trimesh.Trimesh(vertices, faces, process=False), iterations=15)
    shaken = fine.vertices + np.random.default_rng(0).normal(0, 0.0003, fine.vertices.shape)
    return trimesh.Trimesh(shaken, faces, process=False), part[of_face]


if __name__ == "__main__":
    main()
