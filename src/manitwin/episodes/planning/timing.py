"""Time parameterisation of joint paths within velocity and acceleration limits: trapezoidal rest-to-rest, and time-optimal."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.planning.joint_paths import JointPath, JointSegment, path_lengths
from manitwin.episodes.planning.libraries import toppra_library

ACCELERATING_SHARES = (0.5, 0.4, 0.3, 0.22, 0.15, 0.1, 0.06, 0.03)
LOOKED_AT = 41
BETWEEN_LOOKS = 0.01  # safety factor for the path between the sampled parameters

LEAST_GRID = 41


def trapezoid(share: float | np.ndarray, moments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return position and speed on [0, 1] at moments in [0, 1] of a trapezoidal profile.

    Acceleration and deceleration each take a ``share`` of the time.
    """
    peak = 1 / (1 - share)
    first, last = moments**2 / (2 * share), (1 - moments) ** 2 / (2 * share)
    place = np.where(
        moments < share, peak * first, np.where(moments > 1 - share, 1 - peak * last, peak * (moments - share / 2))
    )
    speed = peak * np.minimum(np.minimum(moments / share, (1 - moments) / share), 1.0)
    return place, speed


def time_rest_to_rest(
    path: JointPath, velocity_limits: np.ndarray, acceleration_limits: np.ndarray, timestep_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and velocities ``(T, n)`` at every time step, from rest to rest, within the limits (rad/s, rad/s^2).

    On a joint-space segment the trapezoid is time-optimal: its duration is the larger of V / (1 - f) and sqrt(A / (f (1 -
    f))) for the acceleration share f, with V and A the largest ratios of the joints' displacements to their limits. On other
    paths the fastest of a few shares is used, whose duration follows from the path's derivatives.
    """
    if isinstance(path, JointSegment):
        way = np.abs(path.end - path.start)
        v, a = float((way / velocity_limits).max()), float((way / acceleration_limits).max())
        share = min(0.5, a / (v**2 + a)) if a > 0 else 0.5
        duration_s = max(v / (1 - share), float(np.sqrt(a / (share * (1 - share)))))
    else:
        duration_s, share = _fastest(path, velocity_limits, acceleration_limits)
    steps = max(1, int(np.ceil(duration_s / timestep_s - 1e-9)))
    places, speeds = trapezoid(share, np.arange(steps + 1) / steps)
    positions = path(places)
    velocities = path(places, 1) * (speeds / (steps * timestep_s))[:, None]
    return np.ascontiguousarray(positions), velocities


def _fastest(path: JointPath, velocity_limits: np.ndarray, acceleration_limits: np.ndarray) -> tuple[float, float]:
    """Return the smallest duration that satisfies the limits, and its acceleration share."""
    moments, shares = np.linspace(0, 1, LOOKED_AT), np.array(ACCELERATING_SHARES)[:, None]
    place, speed = trapezoid(shares, moments)
    slope, bend = path(place, 1), path(place, 2) * (speed**2)[..., None]
    change = slope / (shares * (1 - shares))[..., None]
    up, down = (moments <= shares)[..., None], (moments >= 1 - shares)[..., None]
    largest = np.maximum(np.abs(bend + up * change), np.abs(bend - down * change))
    largest = np.maximum(largest, np.abs(bend)) / acceleration_limits
    fastest = (np.abs(slope) * speed[..., None] / velocity_limits).max((1, 2))
    durations_s = np.maximum(fastest, np.sqrt(largest.max((1, 2)))) * (1 + BETWEEN_LOOKS)
    best = int(durations_s.argmin())
    return float(durations_s[best]), ACCELERATING_SHARES[best]


def time_optimal(
    waypoints: np.ndarray, velocity_limits: np.ndarray, acceleration_limits: np.ndarray, timestep_s: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return positions and velocities ``(T, n)`` at every time step along the spline through evenly spaced waypoints, or None.

    Uses TOPP-RA (toppra). Between its grid points the result exceeds the acceleration limits by 2 to 20 per cent; it is
    slowed down accordingly.
    """
    toppra = toppra_library()
    lengths = path_lengths(waypoints)
    problem = toppra.algorithm.TOPPRA(
        [
            toppra.constraint.JointVelocityConstraint(np.column_stack([-velocity_limits, velocity_limits])),
            toppra.constraint.JointAccelerationConstraint(np.column_stack([-acceleration_limits, acceleration_limits])),
        ],
        toppra.SplineInterpolator(lengths / lengths[-1], waypoints),
        gridpoints=np.linspace(0, 1, max(LEAST_GRID, 2 * len(waypoints) - 1)),
        solver_wrapper="seidel",
    )
    trajectory = problem.compute_trajectory(0, 0)
    if trajectory is None:
        return None
    moments = np.linspace(0, trajectory.duration, int(np.ceil(trajectory.duration / timestep_s)) + 1)
    beyond = (np.abs(trajectory(moments, 2)) / acceleration_limits).max()
    duration_s = trajectory.duration * max(1.0, float(np.sqrt(beyond)))
    steps = int(np.ceil(duration_s / timestep_s))
    moments = np.linspace(0, trajectory.duration, steps + 1)
    velocities = trajectory(moments, 1) * (trajectory.duration / (steps * timestep_s))
    positions = trajectory(moments)
    positions[0], positions[-1] = waypoints[0], waypoints[-1]
    velocities[0] = velocities[-1] = 0.0
    return positions, velocities
