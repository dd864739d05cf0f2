"""The size of a twin whose size was a guess, by what a depth picture shows of the thing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.errors import UsageError
from manitwin.geometry.poses import transform, transform_points
from manitwin.scenes.locate.comparison import drawn_depth_m
from manitwin.scenes.locate.depth_view import DepthView
from manitwin.scenes.locate.estimate import AMBIGUOUS_MARGIN, Location, locate_in_view
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.recognition import NO_MASK, Thing, Tried
from manitwin.scenes.locate.search import Candidates, find_candidates

LARGEST_FACTOR = 2.0
"""A photo's size is guessed by what it shows: nearly all things of a name are within this factor of the usual one."""
COARSE, NEAR, NEAR_STEP, FINE_STEP = 7, 4, 0.03, 0.01
"""Sizes that are searched for from all sides; then so many to both sides of the best, and two steps about the best of these."""
SAME_SIZE = 0.05
"""A size that differs by less changes no grasp: wider than the hand's play it is not."""
OTHER_SIZE = (
    "the object has another size than its twin, so the grasps and the mass of the twin do not apply; build the twin"
    " again with the size found"
)
_POSES = 4


@dataclass(frozen=True)
class SizeFit:
    """The ``factor`` from the twin's size to that of the thing, and those between which the picture does not tell.

    ``location`` and ``model`` are of the twin at that size. ``shape_off_m`` is the median difference in depth of what is seen
    from the twin at that size: how far its shape, which was a guess too, is off; None where nothing was found.
    """

    factor: float
    low: float
    high: float
    shape_off_m: float | None
    location: Location
    model: PoseModel

    @property
    def is_own(self) -> bool:
        """Whether it is the twin's own size, as far as grasps feel it."""
        return abs(self.factor - 1) <= SAME_SIZE


def thing_of_any_size(
    view: DepthView, masks: Sequence[np.ndarray], model: PoseModel, *, seed: int = 0
) -> tuple[Thing, SizeFit]:
    """Look for a twin of unknown size in each of several masks, and return the one that it explains best, with its size.

    Raises UsageError where there is no mask.
    """
    if not masks:
        raise UsageError(NO_MASK)
    fits = [(fit_size(view, mask, model, seed=seed), mask) for mask in masks]
    best, mask = max(fits, key=lambda each: each[0].location.best_score)
    tried = (Tried(model.twin_id, None, best.location.best_score),)
    return Thing(mask, best.location, best.model, tried), best


def fit_size(view: DepthView, mask: np.ndarray, model: PoseModel, *, seed: int = 0) -> SizeFit:
    """Find the size at which a twin explains most of what ``mask (H, W) bool`` shows, and where it is then.

    Depths are metres, so that the size shows in what is seen as near as in its outline. Of the sizes that are tried, those that
    explain as much as the best (``AMBIGUOUS_MARGIN``) are the interval.
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
    """Return poses ``(K, 4, 4)`` of the object at another size whose middle stays where it is."""
    moved = []
    for pose in poses:
        middle = transform_points(pose, before * model.center[None])[0]
        moved.append(transform(pose[:3, :3], middle - pose[:3, :3] @ (after * model.center)))
    return np.array(moved)


def _depth_off_m(model: PoseModel, found: Candidates) -> float:
    drawn, _ = drawn_depth_m(model, found.poses[:1], found.evidence)
    off_m = np.abs(drawn[0] - found.evidence.depth_m)[: found.evidence.inside]
    return float(np.median(off_m[np.isfinite(off_m)]))
