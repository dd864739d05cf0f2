"""Targets between actions: exactly those of a motion that is a parabola in time, and never far beyond the actions."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.episodes.joint_targets import JointTargets

LIMITS = np.full(1, -10.0), np.full(1, 10.0)


def test_a_cubic_motion_is_met_at_every_timestep_with_its_speed() -> None:
    targets = JointTargets(np.array([0.3]), *LIMITS)

    def motion(time: float) -> float:
        return 0.3 + 0.7 * time + 2.0 * time**2 - 5.0 * time**3

    for number in range(8):
        rows, speeds = targets.interpolate_to(np.array([motion(0.05 * (number + 1))]), 6)
        assert rows[-1, 0] == pytest.approx(motion(0.05 * (number + 1)))
        if number < 3:
            continue  # which knows nothing of the motion before
        for share, row, speed in zip(np.arange(1, 7) / 6, rows[:, 0], speeds[:, 0], strict=True):
            time = 0.05 * (number + share)
            assert row == pytest.approx(motion(time), abs=1e-12)
            assert speed / 0.05 == pytest.approx(0.7 + 4.0 * time - 15.0 * time**2, abs=0.01)


def test_a_jump_is_ended_at_the_actions_and_overshot_by_about_a_quarter_of_it_at_most() -> None:
    targets = JointTargets(np.array([0.0]), *LIMITS)
    rows = [targets.interpolate_to(np.array([end]), 60)[0] for end in (0.0, 1.0, 1.0, 1.0, 1.0)]
    assert [each[-1, 0] for each in rows] == [0.0, 1.0, 1.0, 1.0, 1.0]
    assert np.concatenate(rows).max() < 1.26
    assert np.concatenate(rows).min() > -0.26
    np.testing.assert_allclose(rows[4], 1.0)


def test_what_would_be_beyond_the_limits_of_the_joints_is_clipped_and_stands_there() -> None:
    targets = JointTargets(np.array([0.0]), np.full(1, 0.0), np.full(1, 1.0))
    found = [targets.interpolate_to(np.array([end]), 60) for end in (1.0, 1.0, 0.0)]
    rows, speeds = (np.concatenate(each)[:, 0] for each in zip(*found, strict=True))
    assert rows.max() == 1.0
    assert rows.min() == 0.0
    beyond = (rows == 1.0) & (np.roll(rows, 1) == 1.0) & (np.roll(rows, -1) == 1.0)
    assert beyond.any()
    assert not speeds[beyond].any()
