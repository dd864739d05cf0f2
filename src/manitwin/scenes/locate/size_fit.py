"""Fit of the size of a twin whose size was a guess, from a depth picture of the object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.errors import UsageError
from manitwin.geometry.poses import transform, transform_points
from manitwin.scenes.locate.depth_view import DepthView
from manitwin.scenes.locate.estimate import AMBIGUOUS_MARGIN, Location, locate_in_view
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.pose_scoring import rendered_depth_m
from manitwin.scenes.locate.recognition import NO_MASK, CandidateTwin, ViewedObject
from manitwin.scenes.locate.search import Candidates, find_candidates

LARGEST_FACTOR = 2.0
"""Search range: nearly all objects of a category are within this factor of the usual size, which is guessed for photos."""
COARSE, NEAR, NEAR_STEP, FINE_STEP = 7, 4, 0.03, 0.01
"""Numbers of sizes searched from all directions, then on both sides of the best, then two fine steps around the best of these."""
SAME_SIZE = 0.05
"""A smaller size difference does not affect grasps, as it is within the play of the hand."""
OTHER_SIZE = (
    "the object has another size than its twin, so the grasps and the mass of the twin do not apply; build the twin"
    " again with the size found"
)
_POSES = 4


@dataclass(frozen=True)
class SizeFit:
    """The ``factor`` from the twin's size to that of the object, and its interval of indistinguishable values.

    ``location`` and ``model`` are those of the twin at this size. ``shape_off_m`` is the median depth difference between the
    observation and the twin at this size, which measures how wrong its guessed shape is; None if nothing was found.
    """

    factor: float
    low: float
    high: float
    shape_off_m: float | None
    location: Location
    model: PoseModel

    @property
    def is_nominal(self) -> bool:
        """Whether it is the twin's own size, up to the tolerance of grasps."""
        return abs(self.factor - 1) <= SAME_SIZE


def locate_at_any_size(
    view: DepthView, masks: Sequence[np.ndarray], model: PoseModel, *, seed: int = 0
) -> tuple[ViewedObject, SizeFit]:
    """Locate a twin of unknown size in each of several masks, and return the mask that it explains best, with its size.

    Raises UsageError if there is no mask.
    """
    if not masks:
        raise UsageError(NO_MASK)
    fits = [(fit_size(view, mask, model, seed=seed), mask) for mask in masks]
    best, mask = max(fits, key=lambda each: each[0].location.best_score)
    tried = (CandidateTwin(model.twin_id, None, best.location.best_score),)
    return ViewedObject(mask, best.location, best.model, tried), best


def fit_size(view: DepthView, mask: np.ndarray, model: PoseModel, *, seed: int = 0) -> SizeFit:
    """Find the size at which a twin explains most of what ``mask (H, W) bool`` shows, and its location.

    Depths are metric, so that size is observable from the distance and the outline together. The interval contains the tried
    sizes that score as much as the best, within ``AMBIGUOUS_MARGIN``.
    """
    tried: dict[float, Candidates] = {}
    for factor in np.geomspace(1 / LARGEST_FACTOR, LARGEST_FACTOR, COARSE):
        tried[float(factor)] = find_candidates(view, mask, model.scaled(float(factor)), np.random.default_rng(seed))
    for step, count in ((NEAR_STEP, NEAR), (FINE_STEP, 2)):
        middle = _best(tried)
        for number in [*range(-count, 0), *range(1, count + 1)]:
            factor = middle * (1 + step) ** number
            guesses = _at_size(tried[middle].poses[:_POSES], model, middle, factor)
            tried[factor] = find_candidates(
                view, mask, model.scaled(factor), np.random.default_rng(seed), guesses=guesses
            )
    best = _best(tried)
    alike = [factor for factor, found in tried.items() if found.scores[0] > tried[best].scores[0] - AMBIGUOUS_MARGIN]
    scaled = model.scaled(best)
    location = locate_in_view(view, mask, scaled, seed=seed, guess=lambda *_: tried[best].poses)
    off_m = _depth_off_m(scaled, tried[best]) if location.poses else None
    return SizeFit(best, min(alike), max(alike), off_m, location, scaled)


def _best(tried: dict[float, Candidates]) -> float:
    return max(tried, key=lambda factor: float(tried[factor].scores[0]))


def _at_size(poses: np.ndarray, model: PoseModel, before: float, after: float) -> np.ndarray:
    """Return poses ``(K, 4, 4)`` of the object at another size, with its centre unchanged."""
    moved = []
    for pose in poses:
        middle = transform_points(pose, before * model.center[None])[0]
        moved.append(transform(pose[:3, :3], middle - pose[:3, :3] @ (after * model.center)))
    return np.array(moved)


def _depth_off_m(model: PoseModel, found: Candidates) -> float:
    drawn, _ = rendered_depth_m(model, found.poses[:1], found.evidence)
    off_m = np.abs(drawn[0] - found.evidence.depth_m)[: found.evidence.inside]
    return float(np.median(off_m[np.isfinite(off_m)]))
