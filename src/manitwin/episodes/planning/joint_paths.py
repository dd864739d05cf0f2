"""Geometric paths of joint positions over [0, 1]: straight in joint space, straight for the gripper, or smoothed."""

from __future__ import annotations

from typing import Protocol

import numpy as np


class JointPath(Protocol):
    """Joint positions over [0, 1], or their first or second derivative, as scipy's splines give them."""

    def __call__(self, places: np.ndarray, nu: int = 0) -> np.ndarray:
        """Return ``(..., n)`` for places ``(...)``."""
        ...


class JointSegment:
    """The straight line in joint space from one configuration to another."""

    def __init__(self, start: np.ndarray, end: np.ndarray):
        """Take configurations ``(n,)``."""
        self.start, self.end = start, end

    def __call__(self, places: np.ndarray, nu: int = 0) -> np.ndarray:
        """Return positions or derivatives at places."""
        places, change = np.asarray(places, float)[..., None], self.end - self.start
        if nu == 0:
            return self.start + places * change
        return np.broadcast_to(change if nu == 1 else np.zeros_like(change), (*places.shape[:-1], len(change)))

    @property
    def length_rad(self) -> float:
        """Its Euclidean length."""
        return float(np.linalg.norm(self.end - self.start))
