"""Targets between actions: exactly those of a motion that is a parabola in time, and never far beyond the actions."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.episodes.environment.arms import JointTargets

LIMITS = np.full(1, -10.0), np.full(1, 10.0)


def test_a_parabola_is_met_at_every_timestep() -> None:
    targets, seen = JointTargets(np.array([0.3]), *LIMITS), []

    def motion(time: float) -> float:
        return 0.3 + 0.7 * time + 2.0 * time**2

    targets.towards(np.array([motion(0.05)]), 6)  # the first step knows nothing of the motion before it
    for number in range(1, 5):
        rows = targets.towards(np.array([motion(0.05 * (number + 1))]), 6)
        seen += [(0.05 * (number + share), row) for share, row in zip(np.linspace(0, 1, 7), rows[:, 0], strict=True)]
    for time, row in seen:
        assert row == pytest.approx(motion(time), abs=1e-12)


def test_a_jump_is_begun_and_ended_at_the_actions_and_overshot_by_an_eighth_of_it_at_most() -> None:
    targets = JointTargets(np.array([0.0]), *LIMITS)
    rows = [targets.towards(np.array([end]), 60) for end in (0.0, 1.0, 1.0, 1.0)]
    assert [each[0, 0] for each in rows] == [0.0, 0.0, 1.0, 1.0]
    assert [each[-1, 0] for each in rows] == [0.0, 1.0, 1.0, 1.0]
    assert np.concatenate(rows).max() == pytest.approx(1 + 1 / 8)
    assert np.concatenate(rows).min() == 0
    np.testing.assert_array_equal(rows[3], np.ones((61, 1)))


def test_what_would_be_beyond_the_limits_of_the_joints_is_clipped() -> None:
    targets = JointTargets(np.array([0.0]), np.full(1, 0.0), np.full(1, 1.0))
    rows = np.concatenate([targets.towards(np.array([end]), 60) for end in (1.0, 1.0, 0.0)])
    assert rows.max() == 1.0
    assert rows.min() == 0.0
