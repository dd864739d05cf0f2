"""Pose search: start orientations compared by points, aligned, rendered and scored."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.scenes.locate.depth_view import DepthView, known_depth, measured_noise_m
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.pose_scoring import PixelSamples, pixel_gains, refine_poses, score_poses, scores_of
from manitwin.scenes.locate.registration import align
from manitwin.scenes.locate.start_poses import find_start_poses, hidden_direction

FOLLOWED, REFINED, TURNED, AROUND, POLISHED = 20, 8, 12, 16, 10
"""Numbers of poses that are aligned roughly, refined, and refined again after rotations about the object's own axes."""
POLISHING, FOLLOWED_LAST = 5, 3
CLIMBED, CLIMBS = 3, (1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 0.25, 0.25)
"""Number of poses that climb, and their relative step lengths (times ``CLIMB_SHARE`` of the diameter and ``CLIMB_RAD``)."""
CLIMB_SHARE, CLIMB_RAD = 0.02, np.deg2rad(3)
APART_RAD = np.deg2rad(8)
"""Poses that differ by a smaller rotation are followed only once."""
FEW, MANY, ALL = 150, 800, 2400
"""Numbers of observed points and pixels in the first and in later rounds, and for the decision."""
TOLERANCE_M, TOLERANCE_OF_NOISE = 0.003, 2.5
ROUGHLY = 2.0
"""Multiple of the tolerance for poses that are not refined yet."""


@dataclass(frozen=True)
class Candidates:
    """Poses ``object_to_camera (K, 4, 4)``, best first, their scores ``(K,)``, and the data of the scoring.

    ``gains (K, N)`` are those of each pixel of the ``evidence`` for each pose (``comparison.pixel_gains``).
    """

    poses: np.ndarray
    scores: np.ndarray
    tolerance_m: float
    evidence: PixelSamples
    gains: np.ndarray


def find_candidates(
    view: DepthView, mask: np.ndarray, model: PoseModel, rng: np.random.Generator, guesses: np.ndarray | None = None
) -> Candidates:
    """Search all orientations for poses in which the object explains what ``mask (H, W) bool`` shows.

    With ``guesses (K, 4, 4)``, these replace the starts from all directions; all later steps are the same.
    """
    observed = observed_points(view, mask, model.diameter_m, rng)
    tolerance_m = TOLERANCE_M + TOLERANCE_OF_NOISE * measured_noise_m(view, mask)
    reach_px = float(view.intrinsics[0, 0] * model.diameter_m / np.median(observed[:, 2]))
    evidence = PixelSamples.sample(view, mask, reach_px, MANY, rng)
    first = PixelSamples.sample(view, mask, reach_px, 2 * FEW, rng)
    few = observed[:FEW]
    poses = find_start_poses(observed, model, hidden_direction(view, mask)) if guesses is None else guesses
    poses = align(few, model.surface, poses, iterations=8, kept_share=0.85)
    scores = score_poses(model, poses, first, ROUGHLY * tolerance_m)
    poses = align(few, model.surface, poses[_best(scores, FOLLOWED)], iterations=8, kept_share=0.9)
    scores = score_poses(model, poses, first, tolerance_m)
    best = _refined(observed, model, poses[_best(scores, REFINED)])
    scores = score_poses(model, best, evidence, tolerance_m)
    turned = (best[_best(scores, 2), None] @ model.near_motions).reshape(-1, 4, 4)
    rough = score_poses(model, turned, first, ROUGHLY * tolerance_m)
    again = _refined(observed, model, turned[_spread(turned, rough, TURNED)])
    poses = np.concatenate([best, again])
    poses, scores = _finer(model, poses, evidence, tolerance_m)
    centers = poses[
        _spread(poses, scores, FOLLOWED_LAST)
    ]  # for a block with a hidden end, it takes a second rotation to undo a flip
    around = np.concatenate([centers, (centers[:, None] @ model.near_motions).reshape(-1, 4, 4)])
    rough = score_poses(model, around, first, tolerance_m)
    around, around_scores = _finer(model, around[_spread(around, rough, AROUND)], evidence, tolerance_m)
    poses, scores = np.concatenate([poses, around]), np.concatenate([scores, around_scores])
    kept = poses[_spread(poses, scores, POLISHED)]
    kept = np.concatenate([hill_climb(model, kept[:CLIMBED], evidence, tolerance_m), kept])
    return _decided(model, kept, PixelSamples.sample(view, mask, reach_px, ALL, rng), tolerance_m)


def _decided(model: PoseModel, poses: np.ndarray, evidence: PixelSamples, tolerance_m: float) -> Candidates:
    """Return candidates scored with the final number of pixels, best first; the best ones are polished once more."""
    finer = np.concatenate([poses, refine_poses(model, poses[:FOLLOWED_LAST], evidence, tolerance_m, POLISHING)])
    gains = pixel_gains(model, finer, evidence, tolerance_m)
    scores = scores_of(gains, evidence)
    order = np.argsort(-scores, kind="stable")
    return Candidates(finer[order], scores[order], tolerance_m, evidence, gains[order])


def observed_points(view: DepthView, mask: np.ndarray, diameter_m: float, rng: np.random.Generator) -> np.ndarray:
    """Return points ``(N, 3)`` within the mask, without those whose depth is off the median by more than the diameter."""
    pixels = np.flatnonzero(mask & known_depth(view))
    depth = view.depth_m.ravel()[pixels]
    pixels = pixels[np.abs(depth - np.median(depth)) < diameter_m]
    return view.points(rng.permutation(pixels)[:MANY])


def _refined(observed: np.ndarray, model: PoseModel, poses: np.ndarray) -> np.ndarray:
    poses = align(observed[: 2 * FEW], model.surface, poses, iterations=12, kept_share=0.92, reach_m=0.02)
    return align(observed, model.surface, poses, iterations=4, kept_share=0.92, reach_m=0.02)


def _finer(
    model: PoseModel, poses: np.ndarray, evidence: PixelSamples, tolerance_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the poses ``(K, 4, 4)``, polished where this improves the score, with their scores, best first.

    Surfaces close behind a thin object attract it: most polished poses of a fork on a table score less than before.
    """
    after = refine_poses(model, poses, evidence, tolerance_m, POLISHING)
    before_scores, scores = (score_poses(model, each, evidence, tolerance_m) for each in (poses, after))
    better = scores >= before_scores
    poses, scores = np.where(better[:, None, None], after, poses), np.where(better, scores, before_scores)
    order = np.argsort(-scores, kind="stable")
    return poses[order], scores[order]


def hill_climb(model: PoseModel, poses: np.ndarray, evidence: PixelSamples, tolerance_m: float) -> np.ndarray:
    """Return poses ``(K, 4, 4)`` after hill climbing on the score, with steps along or about single axes of the camera.

    Alignment trusts each pixel's depth and is misled by edge pixels, to which the score is robust.
    """
    length_m = CLIMB_SHARE * model.diameter_m
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    turns, shifts = CLIMB_RAD * axes, length_m * axes
    scores = score_poses(model, poses, evidence, tolerance_m)
    for scale in CLIMBS:
        rotations = Rotation.from_rotvec(scale * turns).as_matrix()
        tried = np.repeat(poses[:, None], 2 * len(shifts), axis=1)
        tried[:, : len(shifts), :3, 3] += scale * shifts
        centers = poses[:, :3, :3] @ model.center + poses[:, :3, 3]
        tried[:, len(shifts) :, :3, :3] = rotations @ poses[:, None, :3, :3]
        tried[:, len(shifts) :, :3, 3] = centers[:, None] - tried[:, len(shifts) :, :3, :3] @ model.center
        found = score_poses(model, tried.reshape(-1, 4, 4), evidence, tolerance_m).reshape(tried.shape[:2])
        best = found.argmax(1)
        rows = np.arange(len(poses))
        better = found[rows, best] > scores
        poses = np.where(better[:, None, None], tried[rows, best], poses)
        scores = np.where(better, found[rows, best], scores)
    return poses


def _spread(poses: np.ndarray, scores: np.ndarray, count: int) -> np.ndarray:
    """Return the indices of the best poses, no two of which differ by a rotation of less than ``APART_RAD``."""
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
