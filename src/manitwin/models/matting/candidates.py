"""The masks that a photo's matte is chosen from: that of the built-in rules, and those of one to three networks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import cv2
import numpy as np
from scipy import ndimage

from manitwin.models.matting.confidence import MatteScores, score
from manitwin.models.matting.outline import dilated, eroded, opened
from manitwin.models.matting.segmentation import MOSTLY_NARROW, Segmentation, without_specks

Maker = Literal["rules", "network", "second_network", "built_in_network", "both"]
"""``network`` and ``second_network`` are those that a person named; where none is, ``network`` is the built-in one. ``both``
is what the first network found and the parts in focus that rules found besides: no opinion of its own."""
AGREEING = 0.98
"""Likeness of two masks beyond which rules and a network have found the same thing."""
SURE = 0.9
"""Share of object of a pixel that a network calls certain; below one less that, it is certain of the ground."""
ENCLOSING = 0.2
"""Share of object of an outline that encloses something, though the network be unsure of it."""
LEAST_PIXELS = 30
LEAST_ADDED = 0.003
"""Of a network's mask: what rules add beyond that makes a mask of its own."""
MARGIN_PX = 3
SURELY_GROUND, MOST_CERTAIN_OF_SHADE = 0.1, 0.3
"""Mean share of object of a piece, and how much of it has a colour that is not the ground's in shade: of 39 pieces in focus that
rules find and the network does not, in calibration pictures, 35 are ground, 26 of these below both, and none of the others."""
UNLIKE_GROUND = 4.0
"""``Background.distance`` below which nine in ten pixels of the photo's border are."""


@dataclass(frozen=True)
class Candidate:
    """A mask that may be the object, with its scores on the photo; ``maker`` says who found it.

    ``zoom`` is the photo's size over the mask's.
    """

    maker: Maker
    found: Segmentation
    scores: MatteScores
    zoom: float = 1.0

    @property
    def by_network(self) -> bool:
        """Whether a network found it, or most of it."""
        return self.maker != "rules"

    @property
    def independent(self) -> bool:
        """Whether it is an opinion of its own."""
        return self.maker != "both"


def candidates(found: Segmentation, shares: Sequence[np.ndarray], *, zoom: float) -> list[Candidate]:
    """Return the masks to choose from, given what the rules ``found`` and each network's share of object (any size) in [0, 1].

    ``shares`` has one to three, those of the ``network_makers``; ``zoom`` is the photo's size over the mask's. None of the
    masks is empty or the whole picture.
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
    least = np.min([at_size(share, found.mask.shape) for share in shares], axis=0) if shares else None
    return [
        Candidate(maker, each, score(each, zoom=zoom, share=least), zoom)
        for maker, each in masks
        if _has_outline(each.mask)
    ]


def network_makers(count: int) -> tuple[Maker, ...]:
    """Return what ``count`` networks are called, of which the last is the built-in one."""
    named: tuple[Maker, ...] = ("network", "second_network")
    return named[:1] if count == 1 else (*named[: count - 1], "built_in_network")


def _has_outline(mask: np.ndarray) -> bool:
    return bool(mask.any() and (mask & ~eroded(mask, 1)).any())


def completed(share: np.ndarray, found: Segmentation, *, exact: bool = False) -> np.ndarray:
    """Return a network's share of object (any size) at the size of the mask that the rules ``found``, filled within its outline.

    A large plain or printed surface tells a network little, so what it leaves out within its own outline, as far as that is
    ``ENCLOSING``, is object where the rules say so and the colours are neither the ground's nor its shade's. What is seen
    through a hole has the ground's colours, and stays out. On an ``exact`` ground, of one digital colour, what has such
    colours is no ground wherever it is, and no outline of the network's has to enclose it: it may see nothing of an apple.
    """
    share = at_size(share, found.mask.shape)
    within = eroded(found.mask if exact else ndimage.binary_fill_holes(share > ENCLOSING), 2)
    told = opened(within & found.mask & found.colours.certain, 1)
    return np.asarray(np.where(told, 1.0, share), np.float32)


def network_mask(share: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return what a network calls more object than ground, at a ``shape`` (H, W), without specks; empty of next to nothing."""
    mask = at_size(share, shape) > 0.5
    return without_specks(mask) if mask.sum() >= LEAST_PIXELS else np.zeros(shape, bool)


def at_size(share: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return a network's share of object, scaled to a mask's ``shape`` (H, W)."""
    return np.asarray(cv2.resize(share, shape[::-1], interpolation=cv2.INTER_AREA))


def alike(one: np.ndarray, other: np.ndarray) -> float:
    """Return the overlap of two masks but for slivers along their outlines: 1 less what differs, as a share of both."""
    both = int((one | other).sum())
    return float(np.clip(1 - opened(one ^ other, 2).sum() / both, 0, 1)) if both else 0.0


def misjudged(candidate: Candidate, others: list[Candidate], share: np.ndarray) -> float:
    """Return the area, by the candidate's own, of what others see otherwise and what has an outline in focus all around.

    That is a piece that they have and the candidate lacks, or a hole of theirs that it fills. A shadow's edge is soft, and
    ground has none: such a piece is a part of the thing, a grey blade or a dark tip, and such a hole the loop of scissors.
    Where rules and a network have found the same, what a third sees alone is outvoted. What runs out of the picture and does
    not touch the candidate is ground: a joint of boards, a table's edge; and so is what looks like shade to colours and to the
    network's ``share`` (any size): the sharp shadow under a knife.
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
    """Return the pieces of another ``mask`` (H, W) that ``found`` lacks and that are parts of the thing.

    What has an outline in focus, where it is no part of what was found, is a part, a grey blade or a dark tip. What lies within
    and has not the ground's colour is no hole, but a part too. What runs out of the picture is no part of a whole thing, and
    what looks like shade to colours and to a network's ``share`` (any size) is none either.
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
    """Return what tells whether a piece in its box is darker than the ground, of no other colour, and no object to a network."""
    seen, certain = at_size(share, found.mask.shape), found.colours.certain
    darker = found.background.light < 1

    def is_shade(box: tuple[slice, slice], piece: np.ndarray) -> bool:
        sure = seen[box][piece].mean() < SURELY_GROUND and certain[box][piece].mean() < MOST_CERTAIN_OF_SHADE
        return bool(sure and np.median(darker[box][piece]))

    return is_shade


def _at_frame(box: tuple[slice, slice], shape: tuple[int, ...]) -> bool:
    """Tell whether the ``_pieces`` box around a piece of a mask (H, W) reaches the picture's frame."""
    return any(side.start <= 0 or side.stop >= size for side, size in zip(box, shape, strict=True))


def _in_focus(piece: np.ndarray, free: np.ndarray, near_narrow: np.ndarray) -> bool:
    """Tell whether the outline of a piece (H, W), where it is ``free``, is mostly near narrow edges."""
    outline = piece & ~eroded(piece, 1) & free
    return bool(outline.any() and near_narrow[outline].mean() > MOSTLY_NARROW)


def _pieces(mask: np.ndarray) -> Iterator[tuple[tuple[slice, slice], np.ndarray]]:
    """Yield the box around each 4-connected piece of a mask (H, W), and the piece in it."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    for index in range(1, count):
        left, top, width, height, _ = stats[index]
        box = np.s_[
            max(0, top - MARGIN_PX) : top + height + MARGIN_PX, max(0, left - MARGIN_PX) : left + width + MARGIN_PX
        ]
        yield box, labels[box] == index


def doubts(share: np.ndarray, mask: np.ndarray) -> tuple[float, float, float]:
    """Return how unsure a network's ``share`` (H, W) is, and how much it says against a mask within and beyond it.

    Each as a share of the mask's area: pixels between certain object and certain ground; ground within, object beyond, both but
    for a rim of two pixels.
    """
    area = max(int(mask.sum()), 1)
    unsure = float(((share > 1 - SURE) & (share < SURE)).sum() / area)
    within = float((1 - share)[eroded(mask, 2)].sum() / area)
    beyond = float(share[~dilated(mask, 2)].sum() / area)
    return unsure, within, beyond
