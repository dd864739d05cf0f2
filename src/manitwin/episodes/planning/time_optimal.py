"""The fastest timing of a curved path: TOPP-RA (Pham and Pham, IEEE T-RO 34:3, 2018)."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.planning.libraries import toppra_library
from manitwin.episodes.planning.smoothing import path_lengths

LEAST_GRID = 41


def time_optimal(
    waypoints: np.ndarray, velocity_limits: np.ndarray, acceleration_limits: np.ndarray, timestep_s: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return positions and velocities ``(T, n)`` at every timestep along the spline through even waypoints, or None.

    Between its grid points the method goes beyond the accelerations (by 2 to 20 per cent); what does is slowed down.
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
