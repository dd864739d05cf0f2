"""Distances from points to grasps, and the radius that grows."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.geometry.poses import transform
from manitwin.pipeline.association import associate, distances_to_grasps


def test_distance_is_measured_from_the_line_between_the_contacts() -> None:
    pose = transform(translation=np.array([0, 0, -0.1]))  # fingertips at the origin, closing along x
    points = np.array([[0.03, 0, 0], [0.05, 0, 0], [0, 0.04, 0], [0.06, 0.03, 0.04]])
    distance = distances_to_grasps(points, pose[None], np.array([0.1]), np.array([0.06]))
    assert distance[0] == pytest.approx([0, 0.02, 0.04, np.sqrt(0.03**2 * 2 + 0.04**2)])


def test_radius_stays_where_enough_are_near() -> None:
    found = associate(np.linspace(0, 0.1, 101), radius_m=0.03, enough=20, object_size_m=0.3)
    assert (found.radius_m, found.widened) == (0.03, False)
    assert found.index.tolist() == list(range(31))


def test_radius_grows_by_half_until_enough_are_near() -> None:
    found = associate(np.linspace(0, 0.1, 101), radius_m=0.03, enough=60, object_size_m=0.3)
    assert found.radius_m == pytest.approx(0.03 * 1.5**2)
    assert found.widened
    assert len(found.index) == 68


def test_radius_ends_at_the_size_of_the_object() -> None:
    found = associate(np.array([0.01, 0.25, 0.4]), radius_m=0.03, enough=100, object_size_m=0.3)
    assert found.radius_m == 0.3
    assert found.index.tolist() == [0, 1]
