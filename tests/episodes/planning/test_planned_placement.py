"""Goals of an object that has turned in the hand, against what follows from a box's corners."""

import numpy as np
import pytest
from planning_problems import above, brick, standing

from manitwin.episodes.planning.placement import DROP_M, goals_after_slip
from manitwin.geometry.poses import transform, transform_points

GOAL = standing(0.5, -0.2, 0.7, 0.001)
TURN_RAD = 0.2


def turned_about_x(angle_rad: float) -> np.ndarray:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return transform(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]))


def test_goals_give_up_uprightness_step_by_step_and_never_height():
    measured = above(0.08) @ turned_about_x(TURN_RAD)
    asked, higher, half, hanging = goals_after_slip(brick(), GOAL, above(0.08), measured)
    assert (asked == GOAL).all()
    assert higher == pytest.approx(GOAL + transform(translation=np.array([0, 0, DROP_M])) - np.eye(4))
    for goal, tilt_rad in ((half, TURN_RAD / 2), (hanging, TURN_RAD)):
        assert np.arccos(goal[2, 2]) == pytest.approx(tilt_rad, abs=1e-6)
        assert transform_points(goal, brick().hulls[0])[:, 2].min() == pytest.approx(0.001, abs=1e-9)
        center = brick().center_of_mass_m[None]
        assert transform_points(goal, center)[0, :2] == pytest.approx(transform_points(GOAL, center)[0, :2], abs=1e-9)


def test_hand_is_as_planned_where_nothing_is_made_up_for():
    measured = above(0.08) @ turned_about_x(TURN_RAD)
    hanging = goals_after_slip(brick(), GOAL, above(0.08), measured)[-1]
    assert (hanging @ measured)[:3, :3] == pytest.approx((GOAL @ above(0.08))[:3, :3], abs=1e-9)
