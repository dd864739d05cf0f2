"""Candidate masks of a photo: that of the built-in rules, those of one to three networks, and a union of two."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import cv2
import numpy as np
from scipy import ndimage

from manitwin.models.matting.confidence import MatteScores, score
from manitwin.models.matting.outline import dilated, eroded, opened
from manitwin.models.matting.segmentation import MOSTLY_NARROW, Segmentation, remove_specks

Maker = Literal["rules", "network", "second_network", "built_in_network", "both"]
"""Source of a candidate mask.

``network`` and ``second_network`` are networks that the user named; if the user named none, ``network`` is the built-in
network. ``both`` is the first network's mask plus parts in focus that only the rules found; it is not an independent opinion.
"""
AGREEING = 0.98
"""Similarity of two masks above which the rules and a network have found the same object."""
SURE = 0.9
"""Foreground probability above which a network is certain of the object; below 1 - ``SURE`` it is certain of the background."""
ENCLOSING = 0.2
"""Foreground probability of pixels that can enclose a region, although the network is uncertain of them."""
LEAST_PIXELS = 30
LEAST_ADDED = 0.003
"""Share of a network's mask; if the rules add more than that, the union becomes a candidate of its own."""
MARGIN_PX = 3
SURELY_GROUND, MOST_CERTAIN_OF_SHADE = 0.1, 0.3
"""Limits below which a piece is background in shade.

They are the piece's mean foreground probability, and the share of its pixels whose colour is certainly not that of shaded
background. In the calibration pictures the rules find 39 pieces in focus that the network does not. Of these 35 are
background; 26 of the 35 and none of the other 4 are below both limits.
"""
UNLIKE_GROUND = 4.0
"""``Background.distance`` that nine in ten border pixels of a photo stay below."""


@dataclass(frozen=True)
class Candidate:
    """Candidate mask of the object with its scores.

    ``maker`` is its source, ``zoom`` the size of the photo over that of the mask.
    """

    maker: Maker
    found: Segmentation
    scores: MatteScores
    zoom: float = 1.0

    @property
    def by_network(self) -> bool:
        """Whether a network found all or most of the mask."""
        return self.maker != "rules"

    @property
    def independent(self) -> bool:
        """Whether the mask is an opinion of its own."""
        return self.maker != "both"


def candidates(found: Segmentation, shares: Sequence[np.ndarray], *, zoom: float) -> list[Candidate]:
    """Return the candidate masks, given what the rules ``found`` and the foreground probability in [0, 1] of each network.

    ``shares`` has one to three arrays of any size, in the order of ``network_makers``; ``zoom`` is the size of the photo over
    that of the mask. Empty masks and masks that cover the whole picture are left out.
    """
    masks: list[tuple[Maker, Segmentation]] = [("rules", found)]
    for maker, share in zip(network_makers(len(shares)), shares, strict=True):
        learned = network_mask(share, found.mask.shape)
        if learned.any():
            seen = replace(found, mask=learned, shadow=found.shadow & ~learned, hard=found.hard & ~learned)
            masks.append((maker, seen))
            joined = learned | lost_parts(found.mask, seen, share)
            if maker == "network" and joined.sum() > (1 + LEAST_ADDED) * learned.sum():
                whole = replace(seen, mask=joined, shadow=seen.shadow & ~joined, hard=seen.hard & ~joined)
                masks.append(("both", whole))
    least = np.min([resize_share(share, found.mask.shape) for share in shares], axis=0) if shares else None
    return [
        Candidate(maker, each, score(each, zoom=zoom, share=least), zoom)
        for maker, each in masks
        if _has_outline(each.mask)
    ]


def network_makers(count: int) -> tuple[Maker, ...]:
    """Return the maker names of ``count`` networks, of which the last is the built-in one."""
    named: tuple[Maker, ...] = ("network", "second_network")
    return named[:1] if count == 1 else (*named[: count - 1], "built_in_network")


def _has_outline(mask: np.ndarray) -> bool:
    return bool(mask.any() and (mask & ~eroded(mask, 1)).any())


def completed(share: np.ndarray, found: Segmentation, *, exact: bool = False) -> np.ndarray:
    """Return a network's foreground probability at the size of the rules' mask, with large plain regions of the object filled.

    A network may miss a large plain or printed surface. Pixels inside its outline, where that has at least probability
    ``ENCLOSING``, are set to 1 if the rules call them object and their colour is certainly neither the background's nor its
    shade's. Background visible through a hole has the background's colours and is not filled. On an ``exact`` background of
    one digital colour such pixels are object wherever they are, without an enclosing outline, since the network may miss the
    whole object.
    """
    share = resize_share(share, found.mask.shape)
    within = eroded(found.mask if exact else ndimage.binary_fill_holes(share > ENCLOSING), 2)
    told = opened(within & found.mask & found.colours.certain, 1)
    return np.asarray(np.where(told, 1.0, share), np.float32)


def network_mask(share: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return the pixels with foreground probability above 0.5 at a ``shape`` (H, W), without specks.

    The mask is empty if there are fewer than ``LEAST_PIXELS``.
    """
    mask = resize_share(share, shape) > 0.5
    return remove_specks(mask) if mask.sum() >= LEAST_PIXELS else np.zeros(shape, bool)


def resize_share(share: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Scale a network's foreground probability to a mask's ``shape`` (H, W)."""
    return np.asarray(cv2.resize(share, shape[::-1], interpolation=cv2.INTER_AREA))


def alike(one: np.ndarray, other: np.ndarray) -> float:
    """Return the similarity of two masks in [0, 1]: 1 minus the area that differs over the area of the union.

    Differences that are thin slivers along the outlines do not count.
    """
    both = int((one | other).sum())
    return float(np.clip(1 - opened(one ^ other, 2).sum() / both, 0, 1)) if both else 0.0


def disputed_share(candidate: Candidate, others: list[Candidate], share: np.ndarray) -> float:
    """Return the area that other masks judge differently and whose outline is in focus, as a share of the candidate's area.

    Such a region is a piece that another mask has and the candidate lacks, or a hole of another mask that the candidate
    fills. A shadow's edge is soft and bare background has no edge, so such a piece is a part of the object (a grey blade, a
    dark tip) and such a hole is real (the loop of scissors). If the rules and a network agree on a mask, other masks are
    outvoted. Two kinds of pieces are background and do not count: those that reach the image frame without touching the
    candidate (a joint of boards, a table's edge), and those that look like shade both by colour and to the network's
    ``share`` of any size (the sharp shadow under a knife).
    """
    found = candidate.found
    shade = _shade(found, share)
    near_narrow, near = dilated(found.narrow, 3), dilated(found.mask, 3)
    agreeing = [
        other
        for other in others
        if other.by_network != candidate.by_network and alike(found.mask, other.found.mask) > AGREEING
    ]
    total = 0
    for other in agreeing or others:
        theirs = other.found.mask
        holes = ndimage.binary_fill_holes(theirs) & ~theirs
        lost, filled = opened(theirs & ~found.mask, 2), opened(holes & found.mask, 2)
        for pieces, free in ((lost, ~near), (filled, np.ones_like(lost))):
            total += sum(
                int(piece.sum())
                for box, piece in _pieces(pieces)
                if _in_focus(piece, free[box], near_narrow[box])
                and not (pieces is lost and shade(box, piece))
                and not (_at_frame(box, found.mask.shape) and not near[box][piece].any())
            )
    return total / max(int(found.mask.sum()), 1)


def lost_parts(mask: np.ndarray, found: Segmentation, share: np.ndarray) -> np.ndarray:
    """Return the pieces of another ``mask`` (H, W) that ``found`` lacks and that are parts of the object.

    A piece is a part if its free outline is in focus (a grey blade, a dark tip), or if it lies inside and does not have the
    background's colour. Pieces that reach the image frame, and pieces that look like shade by colour and to the network's
    ``share`` (any size), are not parts.
    """
    lost, shade = np.zeros(mask.shape, bool), _shade(found, share)
    near_narrow, free = dilated(found.narrow, 3), ~dilated(found.mask, 3)
    for box, piece in _pieces(opened(mask & ~found.mask, 2)):
        if _at_frame(box, mask.shape) or shade(box, piece):
            continue
        within = not (piece & ~eroded(piece, 1) & free[box]).any()
        unlike_ground = np.median(found.background.distance[box][piece]) > UNLIKE_GROUND
        if unlike_ground if within else _in_focus(piece, free[box], near_narrow[box]):
            lost[box] |= piece
    return lost


def _shade(found: Segmentation, share: np.ndarray) -> Callable[[tuple[slice, slice], np.ndarray], bool]:
    """Return a predicate that tells whether a piece in its box is shaded background: darker, not coloured, and no object."""
    seen, certain = resize_share(share, found.mask.shape), found.colours.certain
    darker = found.background.light < 1

    def is_shade(box: tuple[slice, slice], piece: np.ndarray) -> bool:
        sure = seen[box][piece].mean() < SURELY_GROUND and certain[box][piece].mean() < MOST_CERTAIN_OF_SHADE
        return bool(sure and np.median(darker[box][piece]))

    return is_shade


def _at_frame(box: tuple[slice, slice], shape: tuple[int, ...]) -> bool:
    """Tell whether the box around a piece of a mask (H, W), from ``_pieces``, reaches the image frame."""
    return any(side.start <= 0 or side.stop >= size for side, size in zip(box, shape, strict=True))


def _in_focus(piece: np.ndarray, free: np.ndarray, near_narrow: np.ndarray) -> bool:
    """Tell whether the outline of a piece (H, W), where it is ``free``, lies mostly near narrow edges."""
    outline = piece & ~eroded(piece, 1) & free
    return bool(outline.any() and near_narrow[outline].mean() > MOSTLY_NARROW)


def _pieces(mask: np.ndarray) -> Iterator[tuple[tuple[slice, slice], np.ndarray]]:
    """Yield the box around each 4-connected piece of a mask (H, W), and the piece's mask in that box."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    for index in range(1, count):
        left, top, width, height, _ = stats[index]
        box = np.s_[
            max(0, top - MARGIN_PX) : top + height + MARGIN_PX, max(0, left - MARGIN_PX) : left + width + MARGIN_PX
        ]
        yield box, labels[box] == index


def network_doubts(share: np.ndarray, mask: np.ndarray) -> tuple[float, float, float]:
    """Return how uncertain a network is and how much it objects to a mask: (unsure, within, beyond) as shares of the mask's area.

    ``share`` (H, W) is the network's foreground probability. ``unsure`` counts pixels between certain object and certain
    background, ``within`` sums background probability inside the mask and ``beyond`` foreground probability outside, both
    without a rim of two pixels.
    """
    area = max(int(mask.sum()), 1)
    unsure = float(((share > 1 - SURE) & (share < SURE)).sum() / area)
    within = float((1 - share)[eroded(mask, 2)].sum() / area)
    beyond = float(share[~dilated(mask, 2)].sum() / area)
    return unsure, within, beyond
