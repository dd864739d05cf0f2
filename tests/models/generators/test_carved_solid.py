"""Fields between their nodes, as the solids that are cut out of them see them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from manitwin.errors import Rejected
from manitwin.models.generators.lift.carved_solid import carved_solid_from_field, field_interpolator

CELL = 0.02
ORIGIN = np.array([-0.3, 0.1, -0.2])


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_a_field_is_linear_between_its_nodes_in_whatever_order_it_is_asked_for(kind: type) -> None:
    rng = np.random.default_rng(0)
    field = rng.normal(size=(9, 7, 11)).astype(kind)
    places = rng.uniform(0, 1, (400, 3)) * (np.array(field.shape) - 1.001)
    places[100:300:2, :2] = places[101:301:2, :2]  # along one line, and along two in turn
    places[200:300, :2] = np.resize(places[200:202, :2], (100, 2))
    at = field_interpolator(field, CELL, ORIGIN)
    found = [at(*(ORIGIN + CELL * place).tolist()) for place in places]
    assert found == pytest.approx(map_coordinates(field.astype(np.float64), places.T, order=1), abs=1e-9)


def test_beyond_its_nodes_a_field_is_outside() -> None:
    field = np.ones((5, 5, 5))
    at = field_interpolator(field, CELL, ORIGIN)
    for axis in range(3):
        for beyond in (-0.5, 4.5):
            place = np.full(3, 2.0)
            place[axis] = beyond
            assert at(*(ORIGIN + CELL * place).tolist()) == -CELL


def test_the_level_set_of_a_ball_is_the_ball() -> None:
    axes = [np.arange(start, start + 0.6, CELL) for start in (-0.3, -0.28, -0.31)]
    field = 0.2 - np.linalg.norm(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1), axis=-1)
    carved = carved_solid_from_field(field, CELL, np.array([axis[0] for axis in axes]), [], [])
    assert np.ptp(carved.surface.vertices, axis=0) == pytest.approx(1.0, abs=0.02)
    assert carved.to_carved[0, 0] == pytest.approx(0.4, abs=0.005)


def test_a_field_that_is_nowhere_positive_is_rejected() -> None:
    with pytest.raises(Rejected, match="do not intersect"):
        carved_solid_from_field(np.full((5, 5, 5), -1.0), CELL, ORIGIN, [], [])
