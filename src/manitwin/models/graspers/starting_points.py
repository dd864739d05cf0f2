"""Where on an object grasps are looked for: all over it, more around the selected points and the centre of mass."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from manitwin.geometry.sampling import sample_surface
from manitwin.models.graspers.protocol import GraspRequest

POOL = 20_000  # surface samples to choose starting points from; as many as the paper takes for its candidates
FOCUS_SPREAD_M, FOCUS_WEIGHT = 0.02, 8.0  # starting points lie denser around the selected points ...
CENTER_SPREAD, CENTER_WEIGHT = 0.2, 2.0  # ... and around the centre of mass (as a share of the diagonal)


def starting_points(request: GraspRequest, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw up to ``count`` surface points ``(N, 3)`` and their outward normals ``(N, 3)``."""
    points, normals, _ = sample_surface(request.solid, POOL, rng)
    chosen = rng.choice(POOL, min(POOL, count), replace=False, p=_density(request, points))
    return points[chosen], normals[chosen]


def _density(request: GraspRequest, points: np.ndarray) -> np.ndarray:
    """Return the probability ``(N,)`` with which each surface point is drawn."""
    weight = np.ones(len(points))
    if len(request.focus_points_m):
        distance = cKDTree(request.focus_points_m).query(points)[0]
        weight += FOCUS_WEIGHT * np.exp(-0.5 * (distance / FOCUS_SPREAD_M) ** 2)
    spread_m = CENTER_SPREAD * float(np.linalg.norm(request.solid.extents))
    distance = np.linalg.norm(points - request.center_of_mass_m, axis=1)
    weight += CENTER_WEIGHT * np.exp(-0.5 * (distance / spread_m) ** 2)
    return weight / weight.sum()
