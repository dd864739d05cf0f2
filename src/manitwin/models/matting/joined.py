"""A learned opinion joined with the built-in ones: believed where it is sure of itself and one of them bears it out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from manitwin.models.matting.outline import opened
from manitwin.models.matting.segmentation import Segmentation, holes_seen_through, to_half_contrast, without_specks

SURE = 0.9  # share of object of a pixel that the network calls certain
MOST_SOFT_SHARE = 0.3  # of its mask: a network that does not know what it sees leaves much between 0.1 and 0.9
SAME = 0.9  # agreement beyond which the built-in mask stands, whose outline follows the photo closer
BORNE_OUT = 0.85


@dataclass(frozen=True)
class LearnedOpinion:
    """What a network said: ``sure`` in [0, 1], its ``agreement`` with the mask, how well built-in opinions bear it out.

    ``chosen``: the mask is the network's.
    """

    sure: float
    agreement: float
    borne_out: float
    chosen: bool


def asked(found: Segmentation, alpha: np.ndarray) -> tuple[Segmentation, LearnedOpinion]:
    """Return the segmentation that all opinions make together, given a network's ``alpha`` (any size) float32 in [0, 1]."""
    shape = found.mask.shape
    alpha = np.asarray(cv2.resize(alpha, shape[::-1], interpolation=cv2.INTER_AREA))
    mask = alpha > 0.5
    soft = float(((alpha > 1 - SURE) & (alpha < SURE)).sum() / max(int(mask.sum()), 1))
    sure = float(np.clip(1 - soft / (2 * MOST_SOFT_SHARE), 0, 1))
    if not mask.any() or soft > MOST_SOFT_SHARE:
        return found, LearnedOpinion(sure, _alike(mask, found.mask), 0.0, False)
    mask &= ~holes_seen_through(found, mask)
    same = _alike(mask, found.mask)
    if same > SAME:
        return replace(found, agreement=max(found.agreement, same)), LearnedOpinion(sure, same, same, False)
    cut = without_specks(to_half_contrast(found.background, mask))
    kept = cut if _alike(cut, mask) > SAME else mask
    ways = (found.mask, found.colours.certain, found.colours.possible)
    borne_out = max(_alike(kept, way) for way in ways)
    if borne_out < BORNE_OUT:
        return replace(found, agreement=0.0), LearnedOpinion(sure, same, borne_out, False)
    joined = replace(found, mask=kept, shadow=found.shadow & ~kept, hard=found.hard & ~kept, agreement=borne_out)
    return joined, LearnedOpinion(sure, _alike(mask, kept), borne_out, True)


def _alike(one: np.ndarray, other: np.ndarray) -> float:
    """Return the overlap of two masks but for slivers along their outlines: 1 less what differs, as a share of both."""
    both = int((one | other).sum())
    return float(np.clip(1 - opened(one ^ other, 2).sum() / both, 0, 1)) if both else 0.0
