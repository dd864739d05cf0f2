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


@pytest.mark.parametrize("low_m", [0.0003, 0.0031, 0.0047, 0.0112, 0.0194])
@pytest.mark.parametrize("axis", [Z, -Z])
def test_a_thin_disc_anywhere_along_the_rod_stops_it(low_m: float, axis: np.ndarray) -> None:
    disc = block([-0.03, -0.03, MIDDLE[2] + low_m], [0.03, 0.03, MIDDLE[2] + low_m + 0.0006])
    assert not rod_passes([*FRAME, disc], MIDDLE, axis, 0.005, 0.02)
    assert rod_passes([*FRAME, disc], MIDDLE, axis, 0.005, low_m - 0.0001)


def test_a_thin_needle_across_the_hole_stops_the_rod() -> None:
    needle = block([-0.03, 0.0036, 0.0061], [0.03, 0.0037, 0.0062])
    assert not rod_passes([*FRAME, needle], MIDDLE, Z, 0.005, 0.02)
    assert rod_passes([*FRAME, needle], MIDDLE, Z, 0.0035, 0.02)


def test_rods_pass_where_the_distance_of_a_tilted_block_says_so() -> None:
    """The distance is taken by brute force, of points on the rod's axis and in the block."""
    rng = np.random.default_rng(3)
    axis, share = np.array([0.6, 0.0, 0.8]), np.linspace(0, 1, 21)
    grid = np.stack(np.meshgrid(share, share, share), axis=-1).reshape(-1, 3)
    for _ in range(20):
        middle = rng.normal(0, 0.02, 3)
        size = rng.uniform(0.005, 0.03, 3)
        inside = middle + (grid - 0.5) * size
        inside = inside[np.abs(inside @ axis) <= 0.02]
        if not len(inside):
            continue
        away = float(np.linalg.norm(inside - np.outer(inside @ axis, axis), axis=1).min())
        wall = block((middle - size / 2).tolist(), (middle + size / 2).tolist())
        assert not rod_passes([wall], np.zeros(3), axis, away + 1e-6, 0.02)
        if away > 0.003:
            assert rod_passes([wall], np.zeros(3), axis, away - 0.0025, 0.02)


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
