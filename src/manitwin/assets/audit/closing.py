"""Two fingers closed on an object along lines: the matter between them, and the least opening."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.assets.audit.convex_shapes import ConvexShapes

PAD_M = 0.009
"""Half of a fingertip pad (Panda: 8.75 by 9.25 mm): what its middle misses, its edge may still touch."""

_CLEAR_M = 0.0002


@dataclass(frozen=True)
class Closings:
    """For every grasp: whether a line between the open fingers meets the object, and the least opening ``(N,)`` m.

    ``least_opening_m`` is infinite where no opening lets both fingertips stand free with the object between them.
    """

    meets: np.ndarray
    least_opening_m: np.ndarray


def close_on(
    shapes: ConvexShapes, points: np.ndarray, closing: np.ndarray, approach: np.ndarray, opening_m: float
) -> Closings:
    """Close two fingers on shapes, about ``points (N, 3)`` between the fingertips along ``closing (N, 3)``.

    Five lines a grasp, in the middle of the pad and at its edges; the best of them counts.
    """
    lateral = np.cross(approach, closing)
    ahead = np.cross(closing, lateral)
    offsets = [np.zeros_like(points), *(side * PAD_M * way for way in (lateral, ahead) for side in (1, -1))]
    meets = np.zeros(len(points), dtype=bool)
    least = np.full(len(points), np.inf)
    for offset in offsets:
        enter, leave = shapes.line_intervals(points + offset, closing)
        line_meets, line_least = _line(enter, leave, opening_m)
        meets |= line_meets
        least = np.minimum(least, line_least)
    return Closings(meets, least)


def _line(enter: np.ndarray, leave: np.ndarray, opening_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return whether matter lies between the fingers, and the least opening at which they stand free around some.

    The fingertips are at +s and -s; s is tried just beyond every end of an interval, where a finger first stands free.
    """
    hit = enter < leave
    enter, leave = np.where(hit, enter, np.inf), np.where(hit, leave, np.inf)
    meets = np.any(hit & (enter < opening_m / 2) & (leave > -opening_m / 2), axis=1)
    tried = np.concatenate([-np.where(hit, enter, -np.inf), np.where(hit, leave, np.inf)], axis=1) + _CLEAR_M
    tried = np.where(np.isfinite(tried) & (tried > 0), tried, np.inf)
    blocked = np.zeros_like(tried, dtype=bool)
    between = np.zeros_like(tried, dtype=bool)
    for start, end in zip(enter.T[:, :, None], leave.T[:, :, None], strict=True):
        blocked |= ((start < tried) & (tried < end)) | ((start < -tried) & (-tried < end))
        between |= (start > -tried) & (end < tried)
    free = np.isfinite(tried) & ~blocked & between
    return np.asarray(meets), 2 * np.where(free, tried, np.inf).min(1)
