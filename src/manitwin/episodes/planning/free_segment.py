"""Is the straight line between two configurations free?"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np


def is_segment_free(start: np.ndarray, end: np.ndarray, is_free: Callable[[np.ndarray], bool], step_rad: float) -> bool:
    """Tell whether even places no further apart than ``step_rad`` are free; ``start`` is taken to be.

    The end goes first, then the middle, then the quarters: collisions are met early.
    """
    way = end - start
    count = max(1, int(np.ceil(float(np.linalg.norm(way)) / step_rad)))
    return all(is_free(start + way * place) for place in bisection_places(count))


@lru_cache(maxsize=4096)
def bisection_places(count: int) -> tuple[float, ...]:
    """Return 1 / count, ..., 1 in the order of coarse steps before fine ones."""
    return tuple(k / count for k in sorted(range(1, count + 1), key=lambda k: (k < count, -(k & -k), k)))
