"""Timing against closed forms: never beyond a limit, never slower than it must be."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from manitwin.episodes.planning.joint_paths import JointSegment
from manitwin.episodes.planning.timing import time_rest_to_rest

TIMESTEP_S = 1 / 240
VELOCITY, ACCELERATION = np.array([1.0, 2.0]), np.array([3.0, 4.0])


def rates(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest speeds and accelerations by finite differences."""
    speeds = np.diff(positions, axis=0) / TIMESTEP_S
    return np.abs(speeds).max(0), np.abs(np.diff(speeds, axis=0) / TIMESTEP_S).max(0)


@pytest.mark.parametrize(
    ("way", "expected_s"),
    [
        ([0.1, 0.0], 2 * np.sqrt(0.1 / 3)),  # never at full speed: twice the square root of way by acceleration
        ([2.0, 0.0], 2.0 / 1.0 + 1.0 / 3.0),  # at full speed in between: way by speed, and speed by acceleration
        ([0.1, 3.0], 3.0 / 2.0 + 2.0 / 4.0),  # the second joint is the slower one
    ],
)
def test_joint_segment_takes_no_longer_than_the_limits_ask(way, expected_s):
    start = np.array([0.3, -0.2])
    positions, velocities = time_rest_to_rest(JointSegment(start, start + way), VELOCITY, ACCELERATION, TIMESTEP_S)
    assert (len(positions) - 1) * TIMESTEP_S == pytest.approx(expected_s, abs=TIMESTEP_S)
    assert positions[0] == pytest.approx(start) and positions[-1] == pytest.approx(start + way)
    assert not velocities[0].any() and not velocities[-1].any()


def test_curved_path_keeps_to_the_limits_and_uses_them():
    angle = np.linspace(0, 1.5, 9)
    path = CubicSpline(angle / 1.5, np.column_stack([np.cos(angle), np.sin(2 * angle)]))
    positions, velocities = time_rest_to_rest(path, VELOCITY, ACCELERATION, TIMESTEP_S)
    speed, acceleration = rates(positions)
    assert (speed <= VELOCITY * 1.001).all()
    assert (acceleration <= ACCELERATION * 1.02).all()
    assert max((speed / VELOCITY).max(), (acceleration / ACCELERATION).max()) > 0.8
    middles = (velocities[1:] + velocities[:-1]) / 2
    assert np.diff(positions, axis=0) / TIMESTEP_S == pytest.approx(middles, abs=2e-3)


def test_path_of_no_length_is_at_rest():
    positions, velocities = time_rest_to_rest(JointSegment(np.ones(2), np.ones(2)), VELOCITY, ACCELERATION, TIMESTEP_S)
    assert (positions == 1).all() and not velocities.any()
