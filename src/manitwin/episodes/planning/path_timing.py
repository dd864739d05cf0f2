"""Time parameterisation of task paths: a quintic profile from rest to rest, or truncated near its peak speed."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from manitwin.episodes.planning.joint_paths import JointPath, path_lengths

STRETCHED = 1.02  # safety factor when the limits require a longer duration


def time_quintic(
    path: JointPath,
    limits: tuple[np.ndarray, np.ndarray],
    duration_s: float,
    timestep_s: float,
    beyond: float = 1.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and velocities ``(T, n)`` at every time step, with 10 u^3 - 15 u^4 + 6 u^5 over the path's parameter.

    The duration is ``duration_s``, or longer if ``limits`` (rad/s, rad/s^2) require it. With ``beyond`` > 1 the profile
    covers a path that is longer by this factor, extended straight beyond its end, and is truncated at the path's end, where
    it is then about fastest.
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
    """Return the spline through knots ``(K, n)`` over [0, 1], parameterised by chord length to avoid uneven speed."""
    lengths = path_lengths(knots) + 1e-6 * np.arange(len(knots))
    return CubicSpline(lengths / lengths[-1], knots)
