"""The outline of an object along an axis: widths of its slices, and the piecewise constant fit that explains them best."""

from __future__ import annotations

import numpy as np

SLICES = 48
LEAST_EXPLAINED = 0.35  # fraction of the outline's variance, by sections of constant width and thickness
THIRD_GAIN = 0.2  # additional share that a third section must explain
LEAST_STRETCH = 3  # slices
_ENDS = (0.05, 0.85)  # fraction of the length: range in which a head may end


def slices_along(share: np.ndarray, across_m: np.ndarray) -> list[np.ndarray]:
    """Return the cross coordinates ``(N, 2)`` m of the samples in each of 48 slices; ``share (N,)`` is their position along the
    axis.
    """
    level = np.clip((share * SLICES).astype(int), 0, SLICES - 1)
    return [across_m[level == k] for k in range(SLICES)]


def filled_outline(slices: list[np.ndarray], least_m: float) -> np.ndarray:
    """Return the logarithms of both extents of each slice's samples ``(N, 2)``; slices with few samples are interpolated."""
    rows = [
        np.log(np.maximum(np.ptp(np.quantile(each, (0.03, 0.97), axis=0), axis=0), least_m))
        if len(each) > 3
        else np.full(2, np.nan)
        for each in slices
    ]
    outline = np.array(rows)
    places = np.arange(len(rows))
    for column in outline.T:
        known = np.isfinite(column)
        column[~known] = np.interp(places[~known], places[known], column[known])
    return outline


def best_splits(outline: np.ndarray, count: int, ends: tuple[float, float] = _ENDS) -> tuple[float, tuple[int, ...]]:
    """Return the explained share of the outline's variance by piecewise constant sections, and where the best sections begin.

    The outline ``(K, D)`` is divided at ``count`` (one or two) positions between the shares ``ends`` of the length; a section
    between two positions has at least three slices.
    """
    sums = np.vstack([np.zeros(outline.shape[1]), np.cumsum(outline, axis=0)])

    def between(a: np.ndarray | int, b: np.ndarray | int) -> np.ndarray:
        """Return the sum of squares of the section from ``a`` to ``b`` explained by its mean."""
        return np.asarray(((sums[b] - sums[a]) ** 2).sum(-1) / np.maximum(np.asarray(b) - a, 1))

    whole = float((outline**2).sum()) - float(between(0, SLICES))
    low, high = max(round(ends[0] * SLICES), 1), round(ends[1] * SLICES)
    first = np.arange(low, high + 1)
    if count == 1:
        kept = between(0, first) + between(first, SLICES)
        best = int(kept.argmax())
        return _share(kept[best] - between(0, SLICES), whole), (int(first[best]),)
    a, b = np.meshgrid(first, first, indexing="ij")
    kept = np.where(b - a >= LEAST_STRETCH, between(0, a) + between(a, b) + between(b, SLICES), -np.inf)
    i, j = np.unravel_index(int(kept.argmax()), kept.shape)
    return _share(kept[i, j] - between(0, SLICES), whole), (int(first[i]), int(first[j]))


def _share(explained: float, whole: float) -> float:
    return float(explained) / max(whole, 1e-12)


def explained_confidence(explained: float) -> float:
    return float(np.clip(0.3 + 0.7 * explained, 0.5, 0.9))
