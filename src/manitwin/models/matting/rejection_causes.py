"""Messages that explain why a mask is not accepted, and what the user can do about it."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
from scipy.ndimage import binary_fill_holes

from manitwin.models.matting.belief import FEATURES, LEAST_DIFFERENCE, OPINIONS, log_odds_costs
from manitwin.models.matting.candidates import Candidate
from manitwin.models.matting.confidence import LOW_SCORE, MOST_ZOOM, MatteScores, border_of, frame_cause
from manitwin.models.matting.outline import eroded
from manitwin.models.matting.study import largest_piece

CAUSES = {
    "sharply_bounded": "it is as grey as a shadow, and part of its outline as soft as one: a shadow may hang on it",
    "on_edges": "its outline does not follow edges of the photo",
    "crisp": "its outline is blurred, or a shadow hangs on it",
    "separable": "its colours are too close to the background's",
    "complete": "other things stand out of the background as much",
    "uncut": "the image border cuts it off",
    "stable": "two ways of looking at it do not agree on what it is",
    "whole": "it falls apart into pieces",
    "plain": "the background is too cluttered",
    "unshaded": "part of its outline has the background's colour, dimmed: a shadow may hang on it",
    "solid": "the ground may be seen through it, or it has parts of the ground's colour inside",
    "thick": "it is thin for so small a picture of it, so its outline is a large part of it",
    "kept": "a part of it with a sharp outline may be lost, or a hole in it filled",
    "outermost": "what looks like its shadow has edges as sharp as its outline, so a clear or grey part of it may be lost",
    "bulk": "it is thin for so small a picture of it, so its outline is a large part of it",
    "beside": "something apart from it reaches the image border",
    "network_beyond": "one way of looking takes more for it, beyond its outline or in its holes",
    "network_within": "one way of looking takes less for it: a shadow may hang on it, or a hole in it be filled",
    "network_sharp": "one way of looking is not sure where it ends",
    "colours": "colours alone do not tell a part of it from the background",
}
"""Message for each score or feature. Of equally low scores the first in this order is reported."""
OR_MASK = "give a mask of it (--mask) or an image with an alpha channel"
REMEDY = f"photograph it whole on a plain surface of another colour, or {OR_MASK}"
CROP = "say where it is (--box) or crop that away if it is another thing, or give a mask of it (--mask)"
THIN = ("bulk", "thick")
HOLES = "or parts of it with the background's colour are taken for holes"
BULKIER = 2.0
"""A mask is thin because of its holes if filling them multiplies its area per outline pixel by more than this factor."""
AGAINST = ("network_beyond", "network_within")
ALIKE = 0.9
"""Minimum similarity of two masks that show the same object and differ at most in a part of it."""
FILLING = 0.8
"""Share of the picture's longer side; an object of that length cannot be photographed from much closer."""


def told(candidate: Candidate, features: np.ndarray) -> str:
    """Return why a mask with these ``features`` (F,) is not accepted, followed by the remedy.

    Edges that cross the image frame are reported only if the scene is too cluttered or the frame cuts the object itself.
    """
    cause = frame_cause(candidate.found.background, candidate.found.gradient)
    if cause is None or (cause == "uncut" and candidate.scores.uncut >= LOW_SCORE):
        cause = main_cause(features, candidate.scores)
    if cause in ("uncut", "whole") and _is_beside(candidate.found.mask):
        cause = "beside"
    if cause in THIN and _is_thin_by_its_holes(candidate.found.mask):
        return f"{CAUSES[cause]}, {HOLES}; {_remedy(cause, candidate)}, or photograph it on a surface of another colour"
    return f"{CAUSES[cause]}; {_remedy(cause, candidate)}"


def main_cause(features: np.ndarray, scores: MatteScores) -> str:
    """Return the key of ``CAUSES`` that costs a mask with these ``features`` (F,) the most confidence.

    If that is a disagreement between opinions, the lowest score is returned instead, because it may explain the disagreement.
    If no score is low, the result is ``stable`` where the opinions show different objects, else the network's objection to
    the mask.
    """
    doubts = log_odds_costs(features)
    worst = max(doubts, key=lambda name: doubts[name])
    if worst not in (*OPINIONS, "stable"):
        return worst
    opposed, found = _likeness(features) < ALIKE, asdict(scores)
    telling = [name for name in CAUSES if name in found and (opposed or name != "stable")]
    lowest = min(telling, key=lambda name: round(found[name], 2))
    if found[lowest] < LOW_SCORE:
        return lowest
    if opposed:
        return "stable"
    return worst if worst in CAUSES and worst != "stable" else max(AGAINST, key=lambda name: doubts[name])


def _likeness(features: np.ndarray) -> float:
    """Return the lower of a mask's similarities in [0, 1] to the network's mask and to the best rival, from its ``features``."""
    most = -min(features[FEATURES.index(name)] for name in ("network_alike", "rival"))
    return float(1 - LEAST_DIFFERENCE * np.expm1(most))


def _is_beside(mask: np.ndarray) -> bool:
    """Tell whether the image border cuts pieces of a mask (H, W) but not the largest one, which is the object."""
    border, thing = border_of(mask.shape), largest_piece(mask)
    return bool((mask & border).any() and not (thing & border).any())


def _is_thin_by_its_holes(mask: np.ndarray) -> bool:
    """Tell whether a mask (H, W) is much bulkier with its holes filled: a bracelet, or a bottle as pale as its background."""
    return _bulk_px(np.asarray(binary_fill_holes(mask))) > BULKIER * _bulk_px(mask)


def _bulk_px(mask: np.ndarray) -> float:
    """Return the area of a mask per pixel of its outline."""
    return float(mask.sum() / max(int((mask & ~eroded(mask, 1)).sum()), 1))


def _remedy(cause: str, candidate: Candidate) -> str:
    """Return what the user can do about a cause."""
    if cause == "beside":
        return CROP
    if cause not in THIN:
        return REMEDY
    rows, columns = np.nonzero(candidate.found.mask)
    length = max(np.ptp(rows), np.ptp(columns)) + 1
    ways = ["give a larger photo"] if candidate.zoom < MOST_ZOOM else []
    ways += ["take it from closer"] if length < FILLING * max(candidate.found.mask.shape) else []
    return ", or ".join([*ways, OR_MASK])
