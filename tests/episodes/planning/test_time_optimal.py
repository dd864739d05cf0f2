"""Paths with corners: rounded, timed within the limits, faster than stopping."""

from itertools import pairwise

import numpy as np
import pytest

from manitwin.episodes.planning.joint_paths import JointSegment, path_lengths, round_corners, shortcut
from manitwin.episodes.planning.timing import time_optimal, time_rest_to_rest

TIMESTEP_S = 1 / 240
VELOCITY, ACCELERATION = np.full(3, 1.0), np.full(3, 3.0)
CORNERS = np.array([[0, 0, 0], [1.0, 0, 0], [1.0, 1.2, 0.4], [0.3, 1.4, 1.0]])


def test_rounded_path_is_timed_within_the_limits_and_faster_than_stopping():
    positions, velocities = time_optimal(round_corners(CORNERS, 0.4), VELOCITY, ACCELERATION, TIMESTEP_S)
    speeds = np.diff(positions, axis=0) / TIMESTEP_S
    assert np.abs(speeds).max() <= 1.001
    assert np.abs(np.diff(speeds, axis=0)).max() / TIMESTEP_S <= 3.0 * 1.02
    assert positions[0] == pytest.approx(CORNERS[0]) and positions[-1] == pytest.approx(CORNERS[-1], abs=1e-6)
    assert not velocities[0].any() and not velocities[-1].any()
    stopping = sum(
        len(time_rest_to_rest(JointSegment(a, b), VELOCITY, ACCELERATION, TIMESTEP_S)[0]) - 1
        for a, b in pairwise(CORNERS)
    )
    assert len(positions) - 1 < 0.95 * stopping


def test_rounding_keeps_the_ends_and_stays_near_the_corners():
    rounded = round_corners(CORNERS, 0.2)
    assert (rounded[0] == CORNERS[0]).all() and (rounded[-1] == CORNERS[-1]).all()
    assert np.linalg.norm(rounded[:, None] - CORNERS[1:3], axis=2).min(0).max() < 0.15
    steps = np.linalg.norm(np.diff(rounded, axis=0), axis=1)
    assert steps.max() < 1.1 * 0.05


def test_shortcut_ends_where_it_did_and_is_never_longer_and_never_in_what_is_not_free():
    def outside_disc(configuration: np.ndarray) -> bool:
        return bool(np.hypot(*(configuration - 0.5)) > 0.3)

    detour = np.array([[0.0, 0.5], [0.0, 1.5], [1.0, 1.5], [1.0, 0.5]])
    shorter = shortcut(detour, outside_disc, np.random.default_rng(0), tries=60, check_step_rad=0.02)
    assert (shorter[0] == detour[0]).all() and (shorter[-1] == detour[-1]).all()
    assert path_lengths(shorter)[-1] < 0.75 * path_lengths(detour)[-1]
    for a, b in pairwise(shorter):
        assert all(np.hypot(*(a + (b - a) * u - 0.5)) > 0.295 for u in np.linspace(0, 1, 200))
