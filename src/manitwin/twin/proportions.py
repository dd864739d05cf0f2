"""Confidence intervals of proportions."""

from __future__ import annotations

import math


def wilson_interval(right: int, of: int, z: float = 1.959963984540054) -> tuple[float, float]:
    """Return the Wilson score interval at 95 % of ``right`` out of ``of`` (Wilson 1927, eq. 4); (0, 1) if ``of`` is 0."""
    if of == 0:
        return 0.0, 1.0
    share, square = right / of, z * z / of
    middle = (share + square / 2) / (1 + square)
    half = z * math.sqrt(share * (1 - share) / of + square / (4 * of)) / (1 + square)
    return max(0.0, middle - half), min(1.0, middle + half)
