"""Timing of paths that are followed for their own sake: a quintic from rest to rest, or one that is fastest at the end."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from manitwin.episodes.planning.joint_paths import JointPath, path_lengths

STRETCHED = 1.02  # longer by this than the limits ask for


def time_quintic(
    path: JointPath,
    limits: tuple[np.ndarray, np.ndarray],
    duration_s: float,
    timestep_s: float,
    beyond: float = 1.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and velocities ``(T, n)`` at every timestep: 10 u^3 - 15 u^4 + 6 u^5 over the path's parameter.

    It lasts ``duration_s``, longer where ``limits`` (rad/s, rad/s2) ask for it. With ``beyond`` > 1 the profile is that of a
    path so many times as long, straight on beyond its end, and is cut off where the path ends: it is then about fastest.
    """
    velocity_limits, acceleration_limits = limits
    while True:
        steps = max(2, round(duration_s / timestep_s))
        moments = np.arange(steps + 1) / steps
        places = beyond * (10 * moments**3 - 15 * moments**4 + 6 * moments**5)
        speeds = beyond * (30 * moments**2 - 60 * moments**3 + 30 * moments**4) / (steps * timestep_s)
        inside = np.minimum(places, 1.0)
        positions = path(inside) + np.maximum(places - 1.0, 0.0)[:, None] * path(np.ones_like(places), 1)
        velocities = path(inside, 1) * speeds[:, None]
        accelerations = np.gradient(velocities, timestep_s, axis=0)
        fastest = float((np.abs(velocities) / velocity_limits).max())
        hardest = float(np.sqrt((np.abs(accelerations) / acceleration_limits).max()))
        if max(fastest, hardest) <= 1:
            break
        duration_s *= max(fastest, hardest) * STRETCHED
    end = int(np.searchsorted(places, 1.0 - 1e-12)) + 1
    return positions[:end], velocities[:end]


def joint_spline(knots: np.ndarray) -> CubicSpline:
    """Return the path through knots ``(K, n)`` over [0, 1] by chord length: by number it would stall and rush."""
    lengths = path_lengths(knots) + 1e-6 * np.arange(len(knots))
    return CubicSpline(lengths / lengths[-1], knots)
