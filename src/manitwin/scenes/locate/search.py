"""The poses in which a twin may be seen: sides and turns compared by points, aligned, drawn and compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.scenes.locate.comparison import Evidence, explained, pixel_gains, polished, scores_of
from manitwin.scenes.locate.depth_view import DepthView, known_depth, measured_noise_m
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.registration import align
from manitwin.scenes.locate.starts import hidden_direction, starts

FOLLOWED, REFINED, TURNED, AROUND, POLISHED = 20, 8, 12, 16, 10
"""Poses that are aligned roughly, refined, and refined again after turns about the object's own axes."""
POLISHING, FOLLOWED_LAST = 5, 3
CLIMBED, CLIMBS = 3, (1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 0.25, 0.25)
"""Poses that climb, and the lengths of their steps: shares of a fiftieth of the diameter, and of 3 degrees."""
CLIMB_SHARE, CLIMB_RAD = 0.02, np.deg2rad(3)
APART_RAD = np.deg2rad(8)
"""Turns that alignment makes one are not followed twice."""
FEW, MANY, ALL = 150, 800, 2400
"""Observed points and pixels of the first and of the later rounds, and those that decide."""
TOLERANCE_M, TOLERANCE_OF_NOISE = 0.003, 2.5
ROUGHLY = 2.0
"""Tolerances of poses that are not yet refined."""


@dataclass(frozen=True)
class Candidates:
    """Poses ``object_to_camera (K, 4, 4)``, the best first, their scores ``(K,)``, and how they were scored.

    ``gains (K, N)`` is what each pixel of the ``evidence`` says of each (``comparison.pixel_gains``).
    """

    poses: np.ndarray
    scores: np.ndarray
    tolerance_m: float
    evidence: Evidence
    gains: np.ndarray


def find_candidates(
    view: DepthView, mask: np.ndarray, model: PoseModel, rng: np.random.Generator, guesses: np.ndarray | None = None
) -> Candidates:
    """Search all orientations for those in which the object explains what ``mask (H, W) bool`` shows.

    With ``guesses (K, 4, 4)`` these are aligned instead of starts from all sides; what follows is the same.
    """
    observed = observed_points(view, mask, model.diameter_m, rng)
    tolerance_m = TOLERANCE_M + TOLERANCE_OF_NOISE * measured_noise_m(view, mask)
    reach_px = float(view.intrinsics[0, 0] * model.diameter_m / np.median(observed[:, 2]))
    evidence = Evidence.of(view, mask, reach_px, MANY, rng)
    first = Evidence.of(view, mask, reach_px, 2 * FEW, rng)
    few = observed[:FEW]
    poses = starts(observed, model, hidden_direction(view, mask)) if guesses is None else guesses
    poses = align(few, model.surface, poses, iterations=8, kept_share=0.85)
    scores = explained(model, poses, first, ROUGHLY * tolerance_m)
    poses = align(few, model.surface, poses[_best(scores, FOLLOWED)], iterations=8, kept_share=0.9)
    scores = explained(model, poses, first, tolerance_m)
    best = _refined(observed, model, poses[_best(scores, REFINED)])
    scores = explained(model, best, evidence, tolerance_m)
    turned = (best[_best(scores, 2), None] @ model.near_motions).reshape(-1, 4, 4)
    rough = explained(model, turned, first, ROUGHLY * tolerance_m)
    again = _refined(observed, model, turned[_spread(turned, rough, TURNED)])
    poses = np.concatenate([best, again])
    poses, scores = _finer(model, poses, evidence, tolerance_m)
    centers = poses[
        _spread(poses, scores, FOLLOWED_LAST)
    ]  # of a block with a hidden end, the second turn is one of a flip
    around = np.concatenate([centers, (centers[:, None] @ model.near_motions).reshape(-1, 4, 4)])
    rough = explained(model, around, first, tolerance_m)
    around, around_scores = _finer(model, around[_spread(around, rough, AROUND)], evidence, tolerance_m)
    poses, scores = np.concatenate([poses, around]), np.concatenate([scores, around_scores])
    kept = poses[_spread(poses, scores, POLISHED)]
    kept = np.concatenate([climbed(model, kept[:CLIMBED], evidence, tolerance_m), kept])
    return _decided(model, kept, Evidence.of(view, mask, reach_px, ALL, rng), tolerance_m)


def _decided(model: PoseModel, poses: np.ndarray, evidence: Evidence, tolerance_m: float) -> Candidates:
    """Return candidates scored by as many pixels as decide, the best first, which is aligned by them once more."""
    finer = np.concatenate([poses, polished(model, poses[:FOLLOWED_LAST], evidence, tolerance_m, POLISHING)])
    gains = pixel_gains(model, finer, evidence, tolerance_m)
    scores = scores_of(gains, evidence)
    order = np.argsort(-scores, kind="stable")
    return Candidates(finer[order], scores[order], tolerance_m, evidence, gains[order])


def observed_points(view: DepthView, mask: np.ndarray, diameter_m: float, rng: np.random.Generator) -> np.ndarray:
    """Return points ``(N, 3)`` of what the mask shows, without those that are farther from the middle than the object is long."""
    pixels = np.flatnonzero(mask & known_depth(view))
    depth = view.depth_m.ravel()[pixels]
    pixels = pixels[np.abs(depth - np.median(depth)) < diameter_m]
    return view.points(rng.permutation(pixels)[:MANY])


def _refined(observed: np.ndarray, model: PoseModel, poses: np.ndarray) -> np.ndarray:
    poses = align(observed[: 2 * FEW], model.surface, poses, iterations=12, kept_share=0.92, reach_m=0.02)
    return align(observed, model.surface, poses, iterations=4, kept_share=0.92, reach_m=0.02)


def _finer(
    model: PoseModel, poses: np.ndarray, evidence: Evidence, tolerance_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the poses ``(K, 4, 4)``, polished where that explains more, with their scores, the best first.

    What lies close behind a thin thing pulls at it: of a fork on a table most polished poses explain less than before.
    """
    after = polished(model, poses, evidence, tolerance_m, POLISHING)
    before_scores, scores = (explained(model, each, evidence, tolerance_m) for each in (poses, after))
    better = scores >= before_scores
    poses, scores = np.where(better[:, None, None], after, poses), np.where(better, scores, before_scores)
    order = np.argsort(-scores, kind="stable")
    return poses[order], scores[order]


def climbed(model: PoseModel, poses: np.ndarray, evidence: Evidence, tolerance_m: float) -> np.ndarray:
    """Return poses ``(K, 4, 4)`` after steps uphill on the score itself, each along or about one axis of the camera.

    Alignment trusts each pixel's depth, and is led astray by those of an edge; the score forgives them.
    """
    length_m = CLIMB_SHARE * model.diameter_m
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    turns, shifts = CLIMB_RAD * axes, length_m * axes
    scores = explained(model, poses, evidence, tolerance_m)
    for scale in CLIMBS:
        rotations = Rotation.from_rotvec(scale * turns).as_matrix()
        tried = np.repeat(poses[:, None], 2 * len(shifts), axis=1)
        tried[:, : len(shifts), :3, 3] += scale * shifts
        centers = poses[:, :3, :3] @ model.center + poses[:, :3, 3]
        tried[:, len(shifts) :, :3, :3] = rotations @ poses[:, None, :3, :3]
        tried[:, len(shifts) :, :3, 3] = centers[:, None] - tried[:, len(shifts) :, :3, :3] @ model.center
        found = explained(model, tried.reshape(-1, 4, 4), evidence, tolerance_m).reshape(tried.shape[:2])
        best = found.argmax(1)
        rows = np.arange(len(poses))
        better = found[rows, best] > scores
        poses = np.where(better[:, None, None], tried[rows, best], poses)
        scores = np.where(better, found[rows, best], scores)
    return poses


def _spread(poses: np.ndarray, scores: np.ndarray, count: int) -> np.ndarray:
    """Return the places of the best poses of which no two are turned less than ``APART_RAD`` from each other."""
    kept: list[int] = []
    for place in _best(scores, len(scores)):
        turn = poses[kept, :3, :3].transpose(0, 2, 1) @ poses[place, :3, :3]
        cosine = (np.trace(turn, axis1=1, axis2=2) - 1) / 2
        if not len(cosine) or cosine.max() < np.cos(APART_RAD):
            kept.append(int(place))
        if len(kept) == count:
            break
    return np.array(kept)


def _best(scores: np.ndarray, count: int) -> np.ndarray:
    return np.argsort(-scores, kind="stable")[:count]
