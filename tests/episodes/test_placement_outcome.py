"""Errors of a placement against closed forms, and the verdicts at their limits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manitwin.episodes.outcome import (
    PlacementErrors,
    is_at_rest,
    is_disturbed,
    placement_errors,
    placement_outcome,
)
from manitwin.episodes.settings import EpisodeSettings
from manitwin.geometry.poses import transform

SETTINGS = EpisodeSettings()
CENTER_M = np.array([0.0, 0.0, 0.05])


def turned(
    axis: str, angle_deg: float, goal: np.ndarray, shift_m: tuple[float, float, float] = (0, 0, 0)
) -> np.ndarray:
    """The goal's object turned about a world axis through its own origin, then shifted."""
    rotation = Rotation.from_euler(axis, angle_deg, degrees=True).as_matrix()
    return transform(rotation @ goal[:3, :3], goal[:3, 3] + shift_m)


GOAL = transform(Rotation.from_euler("ZYX", [40, 0, 90], degrees=True).as_matrix(), np.array([0.5, 0.1, 0.02]))


@pytest.mark.parametrize("angle_deg", [0.0, 7.0, 35.0, -120.0, 180.0])
def test_turn_about_the_vertical_is_heading_and_no_tilt(angle_deg: float) -> None:
    errors = placement_errors(turned("z", angle_deg, GOAL), GOAL, np.zeros(3))
    assert np.degrees(errors.yaw_error_rad) == pytest.approx(abs(angle_deg), abs=1e-6)
    assert np.degrees(errors.tilt_rad) == pytest.approx(0, abs=1e-4)
    assert errors.position_error_m == pytest.approx(0, abs=1e-12)


def test_tilt_is_the_angle_between_the_upward_directions_whatever_the_heading() -> None:
    tilted = turned("x", 8.0, turned("z", 50.0, GOAL))
    errors = placement_errors(tilted, GOAL, np.zeros(3))
    assert np.degrees(errors.tilt_rad) == pytest.approx(8.0)
    assert np.degrees(errors.yaw_error_rad) == pytest.approx(50.0)


def test_position_is_that_of_the_centre_of_mass() -> None:
    upright = transform(None, np.array([0.5, 0, 0]))
    errors = placement_errors(turned("x", 90.0, upright, (0.003, 0, 0)), upright, CENTER_M)
    assert errors.position_error_m == pytest.approx(np.linalg.norm([0.003, 0.05, 0.05]))


@pytest.mark.parametrize(
    ("position_m", "tilt_deg", "at_rest", "released", "outcome"),
    [
        (0.0199, 9.9, True, True, None),
        (0.0201, 0.0, True, True, "misplaced"),
        (0.0, 10.1, True, True, "toppled"),
        (0.5, 90.0, True, True, "toppled"),
        (0.0, 0.0, False, True, "misplaced"),
        (0.0, 0.0, True, False, "misplaced"),
        (float("nan"), 0.0, True, True, "misplaced"),
        (0.0, float("nan"), True, True, "toppled"),
    ],
)
def test_verdict_at_the_limits(
    position_m: float, tilt_deg: float, at_rest: bool, released: bool, outcome: str | None
) -> None:
    errors = PlacementErrors(position_m, float(np.radians(tilt_deg)), 3.0)
    assert placement_outcome(errors, at_rest=at_rest, released=released, settings=SETTINGS) == outcome


def test_what_rocks_a_little_is_at_rest_and_what_creeps_or_rolls_is_not() -> None:
    rocking = [turned("x", 0.2 * (-1) ** i, GOAL) for i in range(10)]
    creeping = [turned("z", 0, GOAL, (0.00015 * i, 0, 0)) for i in range(10)]  # 3 mm/s at 20 rows a second
    rolling = [turned("x", 0.1 * i, GOAL) for i in range(10)]
    assert is_at_rest(rocking, CENTER_M, SETTINGS)
    assert not is_at_rest(creeping, CENTER_M, SETTINGS)
    assert not is_at_rest(rolling, CENTER_M, SETTINGS)


def test_other_object_is_disturbed_by_a_shift_or_by_a_turn_alone() -> None:
    before = transform(None, np.array([0.4, 0.2, 0]))
    assert not is_disturbed(before, turned("z", 4.9, before, (0.009, 0, 0)), CENTER_M, SETTINGS)
    assert is_disturbed(before, turned("z", 0, before, (0.0101, 0, 0)), CENTER_M, SETTINGS)
    assert is_disturbed(before, turned("z", 5.1, before), CENTER_M, SETTINGS)
