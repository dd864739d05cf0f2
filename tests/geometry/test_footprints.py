"""Convex footprints and how far apart they are."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.geometry.footprints import footprint, separation_m


def square(x: float, y: float, turn: float = 0.0) -> np.ndarray:
    corners = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (0, 1)])
    cos, sin = np.cos(turn), np.sin(turn)
    return footprint(corners @ np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]).T + [x, y, 0])


def test_a_box_covers_its_four_corners() -> None:
    assert sorted(map(tuple, square(0, 0).tolist())) == [(-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)]


def test_the_separation_of_squares() -> None:
    assert separation_m(square(0, 0), square(1.25, 0.3)) == pytest.approx(0.25)
    assert separation_m(square(0, 0), square(0.8, 0)) == pytest.approx(-0.2)
    # turned by 45 degrees, a corner points at the edge
    assert separation_m(square(0, 0), square(2, 0, np.pi / 4)) == pytest.approx(1.5 - np.sqrt(0.5))


def test_the_bound_is_never_above_the_distance() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        one, other = square(0, 0, rng.uniform(0, 3)), square(*rng.uniform(-3, 3, 2), rng.uniform(0, 3))
        dense = [
            (a + (b - a) * t)
            for polygon in (one, other)
            for a, b in zip(polygon, np.roll(polygon, -1, 0), strict=True)
            for t in np.linspace(0, 1, 40)
        ]
        half = len(dense) // 2
        distance = min(np.linalg.norm(np.array(dense[half:]) - p, axis=1).min() for p in dense[:half])
        assert separation_m(one, other) <= distance + 0.05
