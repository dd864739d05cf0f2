"""None"""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manitwin.geometry.hull_distance import (
    ConvexParts,
    convex_distances,
    distance,
    is_clear_of,
    least_distance,
    overlap_depth,
)
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import StaticBox
from rigid_boxes import block
from scene_twins import bowl, slab, standing_at

CORNER = (block([0, 0, 0], [0.2, 0.02, 0.02]), block([0, 0, 0], [0.02, 0.2, 0.02]))  # an L that lies flat


def test_what_lies_in_the_nook_of_an_l_is_as_far_as_from_its_arms() -> None:
    arms = ConvexParts.of(CORNER).at(np.eye(4))
    dice = ConvexParts.of(slab("dice", 0.03, 0.03, 0.02).hulls).at(standing_at(0.06, 0.055))
    assert distance(arms, dice) == pytest.approx(0.055 - 0.015 - 0.02, abs=1e-6)
    assert is_clear_of(arms, [dice], 0.0199)
    assert not is_clear_of(arms, [dice], 0.0201)
    assert overlap_depth(arms, dice) == 0  # though their common hulls overlap


def test_knife_beside_a_bottle_is_clear_where_circles_overlap() -> None:
    knife = ConvexParts.of(slab("knife", 0.22, 0.02, 0.01).hulls).at(np.eye(4))
    bottle = ConvexParts.of(slab("bottle", 0.06, 0.06, 0.2).hulls).at(standing_at(0.0, 0.055))
    assert is_clear_of(knife, [bottle], 0.01)  # the circles, of 0.11 m and 0.03 m at 0.055 m, would forbid it
    assert distance(knife, bottle) == pytest.approx(0.015, abs=1e-6)


def test_depth_is_the_shortest_way_out() -> None:
    first = ConvexParts.of(slab("box", 0.1, 0.1, 0.1).hulls).at(np.eye(4))
    second = ConvexParts.of(slab("box", 0.1, 0.1, 0.1).hulls).at(standing_at(0.07, 0.02, 0.0992))
    assert overlap_depth(first, second) == pytest.approx(0.0008, abs=1e-6)
    board = ConvexParts.of_box(
        StaticBox("board", np.array([0.5, 0.5, 0.01]), transform(translation=np.array([0, 0, -0.007])))
    )
    assert overlap_depth(first, board.at(transform(translation=np.array([0, 0, -0.007])))) == pytest.approx(
        0.003, abs=1e-6
    )


def test_a_dice_in_a_bowl_is_apart_from_its_walls() -> None:
    vessel = ConvexParts.of(bowl().hulls).at(np.eye(4))
    dice = ConvexParts.of(slab("dice", 0.03, 0.03, 0.03).hulls)
    assert distance(vessel, dice.at(standing_at(0, 0, 0.011))) == pytest.approx(0.005, abs=1e-6)
    assert distance(vessel, dice.at(standing_at(0, 0, 0.005))) == 0


def test_least_distance_is_that_of_the_nearest_pair() -> None:
    dice = ConvexParts.of(slab("dice", 0.03, 0.03, 0.03).hulls)
    placed = [dice.at(standing_at(x, 0)) for x in (0.0, 0.1, 0.15, 0.4)]
    pairs = [(a, b) for i, a in enumerate(placed) for b in placed[i + 1 :]]
    assert least_distance(pairs) == pytest.approx(0.02, abs=1e-6)
    assert least_distance([]) == np.inf


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
