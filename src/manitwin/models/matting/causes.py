"""Why a cut-out is not believed, in words, and what to do about it."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from manitwin.models.matting.belief import doubts_of
from manitwin.models.matting.confidence import MatteScores

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
    "thick": "it is thin for so small a photo, so its outline is a large part of it",
    "kept": "a part of it with a sharp outline may be lost, or a hole in it filled",
    "outermost": "what looks like its shadow has edges as sharp as its outline, so a clear or grey part of it may be lost",
}
"""By score; of equally low scores the first is told."""
REMEDY = "photograph it whole on a plain surface of another colour, or give an image with an alpha channel"
LOW_SCORE = 0.5


def cause_of(features: np.ndarray, scores: MatteScores) -> str:
    """Return which of ``CAUSES`` costs a mask with these ``features`` (F,) the most of its confidence.

    Where it is that the opinions differ, it is the lowest score, since that tells why they may; ``stable`` where none is low.
    """
    doubts = doubts_of(features)
    worst = max(doubts, key=lambda name: doubts[name])
    if worst in CAUSES:
        return worst
    found = asdict(scores)
    lowest = min((name for name in CAUSES if name in found), key=lambda name: round(found[name], 2))
    return lowest if found[lowest] < LOW_SCORE else "stable"
