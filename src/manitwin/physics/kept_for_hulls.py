"""What was made of an object's hulls, kept for the next trials, which are often of the same object."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np

Made = TypeVar("Made")
Hulls = tuple[np.ndarray, ...]


class KeptForHulls(Generic[Made]):
    """Makes something of hulls, each ``(V, 3)`` m, and keeps it until other hulls come."""

    def __init__(self, make: Callable[[Hulls], Made]):
        self._make = make
        self._last: tuple[Hulls, Made] | None = None

    def __call__(self, hulls: Hulls) -> Made:
        """Return what was made of this very tuple of hulls."""
        if self._last is None or self._last[0] is not hulls:
            self._last = hulls, self._make(hulls)
        return self._last[1]
