from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manitwin.geometry.convex_distance import convex_distances

CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


@pytest.mark.parametrize(
    ("shift", "distance"),
    [
        ([1.3, 0, 0], 0.3),  # face to face
        ([1.3, 1.4, 0], 0.5),  # edge to edge
        ([2, 3, 3], 3.0),  # corner to corner: (1, 2, 2)
        ([0.9, 0.2, 0.1], 0.0),
        ([1.0, 0, 0], 0.0),  # they touch
        ([0, 0, 0], 0.0),
    ],
)
def test_distance_of_two_cubes_is_that_of_their_intervals(shift: list[float], distance: float) -> None:
    assert convex_distances(CUBE[None], CUBE[None] + shift)[0] == pytest.approx(distance, abs=1e-7)


def test_many_pairs_agree_with_mujoco() -> None:
    rng = np.random.default_rng(4)
    first = rng.normal(size=(40, 24, 3)) * 0.03
    second = rng.normal(size=(40, 24, 3)) * 0.03 + rng.normal(size=(40, 1, 3)) * 0.12
    found = convex_distances(first, second)
    truth = np.array([_in_mujoco(a, b) for a, b in zip(first, second, strict=True)])
    assert 5 < (truth < 0).sum() < 35
    np.testing.assert_array_equal(found == 0, truth <= 0)
    np.testing.assert_allclose(found, np.maximum(truth, 0), atol=1e-5)


def test_repeated_and_flat_points_are_no_trouble() -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0], [1, 1, 0.0]])
    turned = square @ Rotation.from_euler("xyz", [0.3, 0.2, 0.1]).as_matrix().T
    assert convex_distances(turned[None], turned[None] + [0, 0, 10])[0] > 9
    assert convex_distances(square[None], square[None] + [0.2, 0.1, 0.25])[0] == pytest.approx(0.25, abs=1e-7)


def test_beyond_the_limit_a_lower_bound_will_do() -> None:
    shifts = np.array([[1.05, 0, 0], [4.0, 3.0, 0], [9.0, 9.0, 9.0]])
    pairs = np.repeat(CUBE[None], 3, axis=0), CUBE[None] + shifts[:, None]
    exact, bounded = convex_distances(*pairs), convex_distances(*pairs, beyond_m=0.1)
    assert bounded[0] == pytest.approx(0.05, abs=1e-7)
    assert (bounded[1:] > 0.1).all()
    assert (bounded <= exact + 1e-7).all()


def _in_mujoco(first: np.ndarray, second: np.ndarray) -> float:
    spec = mujoco.MjSpec()
    for name, points in (("a", first), ("b", second)):
        spec.add_mesh(name=name, uservert=points.astype(np.float32).ravel())
        spec.worldbody.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return float(mujoco.mj_geomDistance(model, data, 0, 1, 1.0, None))
