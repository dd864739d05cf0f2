"""Borders between sections of an elongated object: sharp changes of width, the joint of two levers, or a groove.

A taper has no border. Grooves follow the minima rule (D. Hoffman and W. Richards, Parts of recognition, Cognition 18, 1984).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from manitwin.geometry.parts.outline import (
    LEAST_EXPLAINED,
    LEAST_STRETCH,
    SLICES,
    THIRD_GAIN,
    best_splits,
    explained_confidence,
    filled_outline,
    slices_along,
)

Borders = tuple[tuple[int, ...], float]
"""The slices, out of 48, at which one or two further sections begin, and the confidence."""
_SECTION_ENDS = (0.04, 0.96)
"""Fractions of the length: range in which a section may begin; shorter end sections cannot be told apart."""
_SHARP_CONTRAST = 1.06  # ratio of width and thickness (together) across a sharp border
_SHARP, _SHARP_SLICES = 0.5, 2
"""Least fraction of the difference between two sections that occurs within this many slices of the border; less is a taper."""
_LEAST_SECTION = 0.05  # fraction of the area: a smaller section (a pole or plug) yields to a groove
_GROOVE = np.log(1.05)  # below the chord over a groove: mean of log width and log thickness
_GROOVE_SLICES = 5  # on either side of a groove
_NEXT_GROOVE = 0.6  # fraction of the depth of the deepest groove
_GAP_SHARE = 0.25  # fraction of a slice's width: a larger gap separates two pieces, such as the legs of a lever
_JOINT_CONFIDENCE = 0.8
_LEAST_SAMPLES = 24  # per slice, to distinguish a gap from chance


def section_borders(share: np.ndarray, across_m: np.ndarray, size_m: float) -> Borders | None:
    """Return where sections begin along an axis; None if there is no evidence.

    Area-uniform surface samples are at ``share (N,)`` of the length and ``across_m (N, 2)``, the wider axis first.
    """
    slices = slices_along(share, across_m)
    outline = filled_outline(slices, 1e-3 * size_m)
    outline[[0, -1]] = outline[[1, -2]]  # rounded ends are not sections
    sharp = _sharp_borders(outline)
    if sharp is not None and all(
        _LEAST_SECTION <= (share < border / SLICES).mean() <= 1 - _LEAST_SECTION for border in sharp[0]
    ):
        return sharp
    return _joint(slices) or _groove(outline) or sharp


def _sharp_borders(outline: np.ndarray) -> Borders | None:
    """Return the one or two borders that explain the outline, provided that each is sharp."""
    one, first = best_splits(outline, 1, _SECTION_ENDS)
    two, both = best_splits(outline, 2, _SECTION_ENDS)
    for explained, borders in ((two, both), (one, first)) if two - one >= THIRD_GAIN else ((one, first),):
        if (
            explained >= LEAST_EXPLAINED
            and not _is_groove(outline, borders)
            and all(_is_sharp(outline, borders, place) for place in range(len(borders)))
        ):
            return borders, explained_confidence(explained)
    return None


def _is_groove(outline: np.ndarray, borders: tuple[int, ...]) -> bool:
    """Return whether the section between two borders is so short and thin that it is a groove."""
    if len(borders) < 2 or borders[1] - borders[0] > _GROOVE_SLICES:
        return False
    before, middle, after = (each.mean() for each in np.split(outline, borders))
    return bool(middle < min(before, after))


def _is_sharp(outline: np.ndarray, borders: tuple[int, ...], place: int) -> bool:
    """Return whether the sections on both sides of a border differ, mostly within a few slices."""
    edges = (0, *borders, len(outline))
    border = edges[place + 1]
    if not LEAST_STRETCH <= border <= len(outline) - LEAST_STRETCH:
        return False
    change = outline[border : edges[place + 2]].mean(0) - outline[edges[place] : border].mean(0)
    apart = float(np.linalg.norm(change))
    if apart < np.log(_SHARP_CONTRAST) * np.sqrt(2):
        return False
    near = outline[border : border + _SHARP_SLICES].mean(0) - outline[max(border - _SHARP_SLICES, 0) : border].mean(0)
    return bool(near @ change / apart >= _SHARP * apart)


def _joint(slices: list[np.ndarray]) -> Borders | None:
    """Return the borders of the joint of two levers: the single piece between two stretches with two pieces."""
    parted = np.array([_is_parted(each[:, 0]) for each in slices])
    changes = np.flatnonzero(np.diff(parted)) + 1
    edges = np.concatenate([[0], changes, [len(parted)]])
    stretches = [(int(a), int(b)) for a, b in pairwise(edges) if b - a >= LEAST_STRETCH]
    two = [each for each in stretches if parted[each[0]]]
    if len(two) != 2 or two[1][0] - two[0][1] < LEAST_STRETCH:
        return None
    return (two[0][1], two[1][0]), _JOINT_CONFIDENCE


def _is_parted(across_m: np.ndarray) -> bool:
    """Return whether the samples of a slice have a gap across its width."""
    if len(across_m) < _LEAST_SAMPLES:
        return False
    ordered = np.sort(across_m)
    return bool(np.diff(ordered).max() > _GAP_SHARE * np.ptp(ordered))


def _groove(outline: np.ndarray) -> Borders | None:
    """Return the slice of the only deep groove; None if there is none, or another about as deep."""
    size, window = outline.mean(1), _GROOVE_SLICES
    depth = np.zeros(len(size))
    for k in range(window, len(size) - window):
        depth[k] = min(size[k - window : k].max(), size[k + 1 : k + 1 + window].max()) - size[k]
    deepest = int(depth.argmax())
    other = np.abs(np.arange(len(size)) - deepest) > window
    if depth[deepest] < _GROOVE or depth[other].max() > _NEXT_GROOVE * depth[deepest]:
        return None
    return (deepest,), float(np.clip(0.5 + depth[deepest], 0.5, 0.8))
