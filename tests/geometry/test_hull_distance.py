from __future__ import annotations

import numpy as np
import pytest

from manitwin.geometry.hull_distance import ConvexParts, distance, is_clear_of, least_distance, overlap_depth
from manitwin.geometry.placed_object import StaticBox
from manitwin.geometry.poses import transform
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
    assert 0.055 < 0.11 + 0.03  # the circles would forbid it
    assert is_clear_of(knife, [bottle], 0.01)
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
