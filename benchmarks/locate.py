"""Score poses in noisy depth images: rendered scenes with known truth, wrong twins, and poses that cannot be distinguished.

    python benchmarks/locate.py DATASET SCENES... [--wrong N] [--most N] [--seed N] [-o FILE]

Each object of each picture of the scenes (``manitwin layout DATASET --pictures --clutter dense``) that is visible to at least 30
% and in at least 200 pixels is one query. In front of some objects a board is inserted so that 30 to 60 % remain visible. Depths
get the noise of ``scenes/locate/depth_noise.py``; the mask is that of the scene. A pose is right if its ADD(-S) is below a tenth
of the diameter (ADD-S for symmetric shapes, ADD for others). With ``--wrong`` that many other twins, drawn at random, and the one
of the most similar size are searched for with the same mask; they are to be rejected.

Ambiguous by construction are bodies of revolution and square blocks with one knob or handle that is hidden in the picture. The
same bodies with a visible knob are not ambiguous.

Thresholds are set on scenes of one seed, and figures are reported for another seed, separately for both halves of the twins.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from manitwin.geometry.poses import inverse, transform_points
from manitwin.render.cameras import Camera, look_at
from manitwin.render.raycast import cast_camera
from manitwin.scenes.loaded_scene import object_pose
from manitwin.scenes.locate.depth_noise import DepthNoise
from manitwin.scenes.locate.depth_view import DepthView, view_of_camera
from manitwin.scenes.locate.estimate import AMBIGUOUS_MARGIN, LEAST_SCORE, locate_in_view, pose_distances_m
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.perception.bop import OPENGL_TO_OPENCV
from manitwin.scenes.perception.scene_truth import read_scene_truth
from manitwin.twin.loaded_twin import TwinSource

LEAST_SHARE, LEAST_PX, RIGHT = 0.3, 200, 0.1
BANDS = ((0.6, 1.01), (0.3, 0.6))
BACKDROP_M = 1.4
BOARD_FROM, BOARD_CHANCE = 0.8, 0.4
"""Visible share from which a board may be inserted, and its probability. The board leaves 30 to 60 % visible."""


class Models:
    """The pose models of the twins of a data set, each prepared once; ``cpu_s`` holds the preparation time of each."""

    def __init__(self, dataset: Path):
        self._source, self._made, self.cpu_s = TwinSource(dataset), {}, []  # type: ignore[var-annotated]
        self.ids = [each for each in self._source.twin_ids() if self._source.twin(each).record.status == "accepted"]
        self.extents = {each: np.sort(self._source.twin(each).physical.extents_m) for each in self.ids}

    def of(self, twin_id: str) -> PoseModel:
        """Return the pose model of a twin."""
        if twin_id not in self._made:
            before = time.process_time()
            self._made[twin_id] = PoseModel.of_twin(self._source.twin(twin_id))
            self.cpu_s.append(time.process_time() - before)
        return self._made[twin_id]  # type: ignore[no-any-return]

    def others(self, twin_id: str, count: int, rng: np.random.Generator) -> list[tuple[str, str]]:
        """Return ``count`` other twins drawn at random, and the one of the most similar size."""
        rest = [each for each in self.ids if each != twin_id]
        apart = [np.abs(np.log(self.extents[each] / self.extents[twin_id])).sum() for each in rest]
        like = rest[int(np.argmin(apart))]
        chosen = rng.choice(rest, count, replace=False) if count else []
        return [("chance", str(each)) for each in chosen] + ([("alike", like)] if count else [])


def questions(scenes: Path, rng: np.random.Generator) -> Iterator[tuple[str, float, DepthView, np.ndarray, np.ndarray]]:
    """Yield twin id, visible share, the noisy view, the mask and the true pose of each query, in random order."""
    told = [
        (file, truth) for file in sorted(scenes.glob("scenes/*/*/scene.json")) for truth in [read_scene_truth(file)]
    ]
    places = [
        (truth, picture, thing)
        for _, truth in told
        for picture in truth.pictures
        for thing in truth.record.objects
        if picture.views[thing.name].visible_share >= LEAST_SHARE and picture.views[thing.name].visible_px >= LEAST_PX
    ]
    for place in rng.permutation(len(places)):
        truth, picture, thing = places[place]
        world_to_camera = OPENGL_TO_OPENCV @ inverse(picture.camera.camera_to_object)
        depth_m, mask = picture.depth_m, picture.ids == truth.ids[thing.name]
        share = picture.views[thing.name].visible_share
        if share >= BOARD_FROM and rng.random() < BOARD_CHANCE:
            wanted = rng.uniform(*BANDS[1])
            depth_m, mask = behind_board(depth_m, mask, wanted / share, rng)
            share = wanted
        noisy = DepthNoise().simulate_depth(depth_m, rng)
        yield thing.twin_id, share, view_of_camera(picture.camera, noisy), mask, world_to_camera @ object_pose(thing)


def behind_board(
    depth_m: np.ndarray, mask: np.ndarray, left: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Insert a board with a straight edge 5 to 15 cm in front of an object, leaving the share ``left`` of its pixels."""
    rows, columns = np.indices(mask.shape)
    angle = rng.uniform(0, 2 * np.pi)
    along = np.cos(angle) * columns + np.sin(angle) * rows
    board = along > np.quantile(along[mask], left)
    nearer = float(depth_m[mask].min()) - rng.uniform(0.05, 0.15)
    return np.where(board, np.minimum(depth_m, nearer), depth_m), mask & ~board


def errors(model: PoseModel, found: np.ndarray, true: np.ndarray) -> tuple[float, float]:
    """Return ADD and ADD-S (Hinterstoisser et al. 2012) relative to the diameter."""
    points = model.points[::6]
    there, here = transform_points(true, points), transform_points(found, points)
    add = float(np.linalg.norm(there - here, axis=1).mean())
    return add / model.diameter_m, float(cKDTree(here).query(there)[0].mean()) / model.diameter_m


def ask(models: Models, scenes: Path, most: int, wrong: int, seed: int) -> list[dict[str, Any]]:
    """Search for each twin in the pictures, and for wrong twins in its place; return one row per query."""
    rng, rows = np.random.default_rng(seed), []
    for twin_id, share, view, mask, true in questions(scenes, rng):
        if len(rows) == most:
            break
        model = models.of(twin_id)
        before = time.process_time()
        found = locate_in_view(view, mask, model)
        row: dict[str, Any] = {"twin": twin_id, "share": share, "cpu_s": time.process_time() - before, "wrong": []}
        row |= {"status": found.status, "score": found.best_score, "symmetric": len(model.symmetry_poses) > 1}
        if found.poses:
            each = [errors(model, pose.object_to_camera, true) for pose in found.poses]
            right = [adds < RIGHT if row["symmetric"] else add < RIGHT for add, adds in each]
            row |= {"right": right[0], "any_right": any(right), "adds_right": each[0][1] < RIGHT, "poses": len(each)}
            row["apart"] = float(
                pose_distances_m(model, found.poses[0].object_to_camera[None], true)[0] / model.diameter_m
            )
        for how, other in models.others(twin_id, wrong, rng):
            guess = locate_in_view(view, mask, models.of(other))
            row["wrong"].append({"twin": other, "how": how, "status": guess.status, "score": guess.best_score})
        rows.append(row)
    return rows


def told(rows: list[dict[str, Any]], name: str) -> None:
    """Print the figures of a set of queries."""
    for low, high in BANDS:
        some = [row for row in rows if low <= row["share"] < high]
        if not some:
            continue
        right = np.mean([row.get("right", False) for row in some])
        among = np.mean([row.get("any_right", False) for row in some])
        unsure = np.mean([row["status"] == "ambiguous" for row in some])
        none = np.mean([row["status"] == "none" for row in some])
        cpu = [row["cpu_s"] for row in some]
        print(
            f"{name:22} visible {low:.1f}..{min(high, 1):.1f} {len(some):4}: right {right:6.1%}, among those given {among:6.1%},"
            f" ADD-S {np.mean([row.get('adds_right', False) for row in some]):6.1%}; said ambiguous {unsure:5.1%}, none"
            f" {none:5.1%}; {np.mean(cpu):.2f} CPU-s, at most {np.max(cpu):.2f};"
            f" scores {np.quantile([row['score'] for row in some], [0, 0.05, 0.5]).round(3)}"
        )
    for how in ("chance", "alike"):
        scores = [(w["status"] == "none", w["score"]) for row in rows for w in row["wrong"] if w["how"] == how]
        if scores:
            high = np.quantile([each for _, each in scores], [0.5, 0.9, 0.95, 0.99]).round(3)
            print(
                f"{name:22} wrong twin, by {how:6} {len(scores):4}: refused {np.mean([r for r, _ in scores]):6.1%}; {high}"
            )


def knobbed(seed: int) -> tuple[str, trimesh.Trimesh, float]:
    """Return a name, a body that is symmetric about z except for one knob at azimuth 0, and the angle of its symmetry."""
    rng = np.random.default_rng(seed)
    radius, height = rng.uniform(0.03, 0.06), rng.uniform(0.06, 0.14)
    knob = trimesh.creation.box(rng.uniform([0.012, 0.01, 0.015], [0.02, 0.018, 0.04]))
    if seed % 2:
        body = trimesh.creation.cylinder(radius, height, sections=96)
        kind, step = "round", 0.0
    else:
        body = trimesh.creation.box((2 * radius, 2 * radius, height))
        kind, step = "square", np.pi / 2
    knob.apply_translation([radius + 0.3 * knob.extents[0], 0, rng.uniform(-0.2, 0.2) * height])
    return kind, trimesh.util.concatenate([body, knob]), step


def ask_ambiguous(count: int) -> list[dict[str, Any]]:
    """Search for bodies with a knob from viewpoints where the knob is hidden, and from others where it is visible."""
    rows = []
    for seed in range(count):
        kind, mesh, step = knobbed(seed)
        model = PoseModel.of_mesh(f"{kind} {seed}", mesh)
        rng = np.random.default_rng(seed)
        for hidden in (True, False):
            # A square block rotated by 90 degrees hides its knob if the camera sees only the two other sides.
            base = np.pi * 0.75 if step else np.pi
            azimuth = base + rng.uniform(-0.15, 0.15) if hidden else rng.uniform(0.4, 0.9)
            elevation, away = rng.uniform(0.15, 0.4), rng.uniform(0.6, 1.0)
            eye = away * np.array(
                [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)]
            )
            camera = Camera(look_at(eye, np.zeros(3)), float(np.deg2rad(30)), 320, 320)
            depth, _, face = cast_camera(model.caster, camera)
            knob_px = int((face >= len(mesh.faces) - 12).sum())
            noisy = DepthNoise().simulate_depth(np.where(depth > 0, depth, BACKDROP_M), rng)
            found = locate_in_view(view_of_camera(camera, noisy), depth > 0, model)
            true = OPENGL_TO_OPENCV @ inverse(camera.camera_to_object)
            apart = [pose_distances_m(model, p.object_to_camera[None], true)[0] / model.diameter_m for p in found.poses]
            rows.append(
                {
                    "kind": kind,
                    "seed": seed,
                    "knob_px": knob_px,
                    "counts": len(model.symmetry_poses) == 1,
                    "status": found.status,
                    "score": found.best_score,
                }
                | {
                    "poses": len(found.poses),
                    "apart": min(apart, default=None),
                    "best_apart": apart[0] if apart else None,
                }
            )
    return rows


def told_ambiguous(rows: list[dict[str, Any]]) -> None:
    """Print how often ambiguity was reported where it exists, and where it does not."""
    for name, some in (
        ("hidden knob", [row for row in rows if row["counts"] and row["knob_px"] == 0]),
        ("knob in sight", [row for row in rows if row["counts"] and row["knob_px"] >= 40]),
    ):
        if some:
            said = np.mean([row["status"] == "ambiguous" for row in some])
            none = np.mean([row["status"] == "none" for row in some])
            right = np.mean([row["best_apart"] is not None and row["best_apart"] < RIGHT for row in some])
            print(
                f"{name:16} {len(some):4}: said ambiguous {said:6.1%}, none {none:5.1%}; the best pose is right {right:6.1%}"
            )


def main() -> None:
    """Score the poses of a data set's twins in rendered scenes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("scenes", type=Path, nargs="*")
    parser.add_argument("--wrong", type=int, default=1)
    parser.add_argument("--most", type=int, default=120)
    parser.add_argument("--bodies", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--out", type=Path)
    given = parser.parse_args()
    models, kept = Models(given.dataset), {}
    print(f"refused below {LEAST_SCORE}, ambiguous within {AMBIGUOUS_MARGIN}")
    for scenes in given.scenes:
        rows = kept[scenes.name] = ask(models, scenes, given.most, given.wrong, given.seed)
        first = set(models.ids[: len(models.ids) // 2])
        told(rows, scenes.name)
        told([row for row in rows if row["twin"] in first], f"{scenes.name}, first half")
        told([row for row in rows if row["twin"] not in first], f"{scenes.name}, second half")
        print(f"{scenes.name}: {len({row['twin'] for row in rows})} twins asked for")
    if models.cpu_s:
        print(f"preparing a twin, once: {np.mean(models.cpu_s):.2f} CPU-s, at most {max(models.cpu_s):.2f}")
    rows = kept["ambiguous"] = ask_ambiguous(given.bodies)
    told_ambiguous(rows)
    if given.out:
        given.out.write_text(json.dumps(kept, indent=1, default=float))


if __name__ == "__main__":
    main()
