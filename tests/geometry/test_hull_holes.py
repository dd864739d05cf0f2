"""Holes between hulls: a square frame of four blocks, whose hole is known."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.geometry.hull_holes import enclosed_share, free_way_m, rod_passes
from rigid_boxes import block

Z = np.array([0.0, 0, 1])
FRAME = [
    block([-0.03, -0.03, 0], [-0.01, 0.03, 0.01]),
    block([0.01, -0.03, 0], [0.03, 0.03, 0.01]),
    block([-0.01, -0.03, 0], [0.01, -0.01, 0.01]),
    block([-0.01, 0.01, 0], [0.01, 0.03, 0.01]),
]
MIDDLE = np.array([0.0, 0, 0.005])


@pytest.mark.parametrize(
    ("radius_m", "aside_m", "axis", "passes"),
    [
        (0.0099, 0.0, Z, True),
        (0.0101, 0.0, Z, False),
        (0.005, 0.0049, Z, True),
        (0.005, 0.0051, Z, False),
        (0.002, 0.0, [1.0, 0, 0], False),
        (0.005, 0.045, Z, True),
    ],
)
def test_a_rod_passes_where_it_is_thinner_than_the_hole(radius_m: float, aside_m: float, axis, passes: bool) -> None:
    assert rod_passes(FRAME, MIDDLE + np.array([aside_m, 0, 0]), np.array(axis), radius_m, 0.02) is passes


def test_a_point_is_enclosed_in_the_hole_and_not_beside_it_or_in_a_notch() -> None:
    assert enclosed_share(FRAME, MIDDLE, Z, 0.03) == 1.0
    assert enclosed_share(FRAME, MIDDLE + np.array([0.007, 0.007, 0]), Z, 0.03) == 1.0
    assert enclosed_share(FRAME, MIDDLE, Z, 0.005) == 0.0
    assert enclosed_share(FRAME, MIDDLE + np.array([0.05, 0, 0]), Z, 0.03) < 0.5
    assert enclosed_share(FRAME, MIDDLE + np.array([0, 0, 0.02]), Z, 0.03) == 0.0
    assert enclosed_share(FRAME[:3], MIDDLE, Z, 0.03) < 0.9


def test_ways_to_the_walls() -> None:
    assert free_way_m(FRAME, MIDDLE, np.array([2.0, 0, 0])) == pytest.approx(0.01)
    assert free_way_m(FRAME, MIDDLE, np.array([1.0, 1, 0])) == pytest.approx(0.01 * np.sqrt(2))
    assert free_way_m(FRAME, MIDDLE, Z) == np.inf
    assert free_way_m(FRAME, np.array([0.02, 0, 0.005]), Z) == 0.0
