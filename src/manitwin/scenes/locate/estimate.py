"""Pose decision for a view: one pose, several equally likely ones, or rejection of the twin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from manitwin.geometry.poses import transform_points
from manitwin.scenes.locate.depth_view import LEAST_PX, DepthView, known_depth
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.pose_scoring import PixelSamples, rendered_depth_m
from manitwin.scenes.locate.search import Candidates, find_candidates

LEAST_SCORE = 0.8
"""Least score of an accepted pose. Set on the tuning half of ``benchmarks/locate.py``."""
AMBIGUOUS_MARGIN, AMBIGUOUS_SIGMA = 0.006, 4.5
"""Another pose is distinguished if it scores less by this margin, and by this many standard errors over differing pixels.

The latter keeps small features such as a knob, which are few pixels, apart from noise. Set like ``LEAST_SCORE``.
"""
DIFFERENT_SHARE = 0.1
"""Share of the diameter: poses with a larger mean point distance, up to symmetry, are different (the usual threshold of ADD)."""
MOST_POSES = 8
_POINTS = 80

Status = Literal["found", "ambiguous", "none"]
Guess = Callable[[DepthView, np.ndarray, PoseModel], np.ndarray]
"""A function that returns poses ``(K, 4, 4)`` in which a twin may be visible at the mask."""


@dataclass(frozen=True)
class PoseEstimate:
    """A pose ``object_to_camera (4, 4)``, m, its score in 0..1, and the visible share of the rendered object."""

    object_to_camera: np.ndarray
    score: float
    visible_share: float


@dataclass(frozen=True)
class Location:
    """The decision on a twin in a view. ``poses``, best first, is empty for the answer ``none``.

    ``best_score`` is that of the best pose, accepted or not; ``tolerance_m`` is the depth difference from which on a pixel is
    unexplained.
    """

    twin_id: str
    status: Status
    poses: tuple[PoseEstimate, ...]
    best_score: float
    reason: str
    pixels: int
    tolerance_m: float


def locate_in_view(
    view: DepthView, mask: np.ndarray, model: PoseModel, *, seed: int = 0, guess: Guess | None = None
) -> Location:
    """Find the pose of a twin that ``mask (H, W) bool`` shows in a view, deterministically for a seed.

    Candidates over all orientations are aligned and rendered (``search``); the score is the share of the observed pixels that
    the rendered twin explains (``comparison.explained``). ``guess`` replaces only the starts of the search; its poses are
    aligned, scored and rejected in the same way. Raises UsageError for a mask with hardly any known depth.
    """
    pixels = int((mask & known_depth(view)).sum())
    if pixels < LEAST_PX:
        return Location(
            model.twin_id,
            "none",
            (),
            0.0,
            f"{pixels} pixels show it at a known depth; {LEAST_PX} are needed",
            pixels,
            0.0,
        )
    guesses = None if guess is None else guess(view, mask, model)
    found = find_candidates(view, mask, model, np.random.default_rng(seed), guesses)
    best = float(found.scores[0])
    if best < LEAST_SCORE:
        reason = (
            f"its best pose explains {best:.0%} of what is seen, at least {LEAST_SCORE:.0%} are needed: another thing, one of"
            " another size, or a mask of more than one thing"
        )
        return Location(model.twin_id, "none", (), best, reason, pixels, found.tolerance_m)
    poses = _different(found, model)
    shares = visible_shares(model, np.array([found.poses[i] for i in poses]), found.evidence, found.tolerance_m)
    estimates = tuple(
        PoseEstimate(found.poses[i], float(found.scores[i]), float(share))
        for i, share in zip(poses, shares, strict=True)
    )
    status: Status = "ambiguous" if len(estimates) > 1 else "found"
    told = (
        "what is seen is the same in each of these poses" if status == "ambiguous" else "no other pose explains as much"
    )
    return Location(model.twin_id, status, estimates, best, told, pixels, found.tolerance_m)


def pose_distances_m(model: PoseModel, poses: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return for each of ``poses (K, 4, 4)`` the mean distance (m) of its surface points from those in pose ``other (4, 4)``.

    It is the minimum over the shape's symmetries: ADD of Hinterstoisser et al. 2012 with BOP's symmetries. For a ball, it is
    the displacement of the centre.
    """
    if model.symmetries.ball:
        moved = poses - other
        return np.asarray(np.linalg.norm(moved[:, :3, :3] @ model.symmetries.center_m + moved[:, :3, 3], axis=1))
    points = model.points[:: max(1, len(model.points) // _POINTS)]
    there = transform_points(other, points)
    same = model.symmetry_poses
    moved = np.einsum("sij,nj->sni", same[:, :3, :3], points) + same[:, None, :3, 3]
    seen = np.einsum("kij,snj->ksni", poses[:, :3, :3], moved) + poses[:, None, None, :3, 3]
    return np.asarray(np.linalg.norm(seen - there, axis=3).mean(2).min(1))


def visible_shares(model: PoseModel, poses: np.ndarray, evidence: PixelSamples, tolerance_m: float) -> np.ndarray:
    """Return the visible share of each rendered pose, ``(K,)``; the rest is hidden by something nearer."""
    drawn, _ = rendered_depth_m(model, poses, evidence)
    hit = np.isfinite(drawn)
    seen = hit & (drawn < evidence.depth_m + tolerance_m)
    shown = (hit * evidence.weight).sum(1)
    return np.asarray((seen * evidence.weight).sum(1) / np.maximum(shown, 1e-9))


def margins(found: Candidates) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much each candidate scores less than the best, and the same in standard errors over pixels, ``(K,)``.

    Each sampled pixel counts once in the standard errors rather than by its weight: noise is independent, and a few samples
    with large weights far from the object would dominate those on the object.
    """
    less = found.gains[0] - found.gains
    spread = np.sqrt((less**2).sum(1))
    return found.scores[0] - found.scores, less.sum(1) / np.maximum(spread, 1e-12)


def _different(found: Candidates, model: PoseModel) -> list[int]:
    """Return the indices of the best candidate, and of different poses that cannot be distinguished from it."""
    less, sigma = margins(found)
    near = np.flatnonzero((less < AMBIGUOUS_MARGIN) | (sigma < AMBIGUOUS_SIGMA))
    kept: list[int] = []
    bar_m = DIFFERENT_SHARE * model.diameter_m
    for place in near:
        if len(kept) == MOST_POSES:
            break
        if not kept or pose_distances_m(model, found.poses[kept], found.poses[place]).min() > bar_m:
            kept.append(int(place))
    return kept
