"""The weight of what is lifted and the friction of two pads: which grasps bear it about the axis of the jaws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.steady_grasps import (
    bears_weight,
    by_largest_torque,
    steady_tiers,
    torsion_limits_nm,
    touch_narrowly,
    weight_torque_nm,
)
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.parallel import ParallelGripper
from rigid_boxes import above, box

HAND = load_gripper("panda")
assert isinstance(HAND, ParallelGripper)
QUARTER = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])


def bar(mass_kg: float, turn: np.ndarray | None = None) -> PlacedObject:
    """A bar 30 cm long along X, about its own centre."""
    return PlacedObject("bar", "bar", box([0.3, 0.04, 0.04], mass_kg), transform(turn, np.array([0.5, 0.1, 0.02])))


def held_at(x_m: float) -> Grasp:
    """From above, closing across the bar, along its Y."""
    across = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
    hand = transform(across, np.array([x_m, 0, HAND.tip_depth_m]))
    return Grasp(f"{x_m}", hand, 0.04)


def test_the_torque_of_the_weight_is_its_lever_by_the_closing_axis() -> None:
    for turn in (None, QUARTER):
        assert weight_torque_nm(held_at(0.1), bar(0.5, turn), HAND) == pytest.approx(0.1 * 0.5 * 9.81)
    assert weight_torque_nm(held_at(0.0), bar(0.5), HAND) == pytest.approx(0.0, abs=1e-9)
    along = Grasp(
        "along", above([0.1, 0, 0.0]), 0.04
    )  # the jaws' axis points to the middle: no weight turns it about that
    assert weight_torque_nm(along, bar(0.5), HAND) == pytest.approx(0.0, abs=1e-9)
    on_end = bar(0.5, np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]]))
    assert weight_torque_nm(held_at(0.1), on_end, HAND) == pytest.approx(0.0, abs=1e-9)


def test_a_line_bears_less_than_a_face_and_both_as_much_as_the_pads_press() -> None:
    line_nm, face_nm = torsion_limits_nm(HAND)
    across_m, along_m = HAND.pad_half_extents_m
    assert line_nm == pytest.approx(HAND.finger_friction * HAND.force_n * across_m)
    disc_m = np.sqrt(4 * across_m * along_m / np.pi)
    assert face_nm == pytest.approx(4 / 3 * HAND.finger_friction * HAND.force_n * disc_m)
    assert line_nm < face_nm
    twice = torsion_limits_nm(replace(HAND, force_n=2 * HAND.force_n))
    assert twice == pytest.approx((2 * line_nm, 2 * face_nm))


def test_grasps_near_the_middle_come_first_and_those_that_cannot_bear_it_not_at_all() -> None:
    line_nm, face_nm = torsion_limits_nm(HAND)
    heavy, weight_n = bar(0.5), 0.5 * 9.81
    light, doubtful, end = 0.5 * line_nm / weight_n, (line_nm + face_nm) / 2 / weight_n, 1.01 * face_nm / weight_n
    grasps = [held_at(x) for x in (end, doubtful, light, 0.0)]
    assert steady_tiers(grasps, heavy, HAND) == [(grasps[2], grasps[3]), (grasps[1],)]
    assert [bears_weight(grasp, heavy, HAND) for grasp in grasps] == [False, False, True, True]
    assert steady_tiers(grasps, bar(0.05), HAND) == [tuple(grasps)]
    assert steady_tiers(grasps[:1], heavy, HAND) == []


def test_other_grippers_keep_the_order_of_their_grasps() -> None:
    grasps = [held_at(x) for x in (0.14, 0.0)]
    for name in ("suction", "allegro"):
        assert steady_tiers(grasps, bar(2.0), load_gripper(name)) == [tuple(grasps)]
        assert bears_weight(grasps[0], bar(2.0), load_gripper(name))
        assert steady_tiers([], bar(2.0), load_gripper(name)) == []


def test_of_what_is_held_any_way_up_grasps_near_the_middle_and_broad_ones_come_first() -> None:
    heavy = bar(2.0).body
    x_m = (0.12, 0.0, 0.1, 0.03)
    grasps = [held_at(x) for x in x_m]
    assert [each.grasp_id for each in by_largest_torque(grasps, heavy, HAND)] == ["0.0", "0.03", "0.1", "0.12"]
    upright = Grasp("upright", above([0.12, 0, 0.0]), 0.04)  # its closing axis leads through the middle
    assert by_largest_torque([grasps[0], upright], heavy, HAND) == [upright, grasps[0]]
    light = bar(0.03).body
    assert by_largest_torque(grasps, light, HAND) == grasps
    low = replace(
        held_at(0.0), gripper_to_object=held_at(0.0).gripper_to_object @ transform(None, np.array([0, 0, -0.026]))
    )
    assert touch_narrowly([*grasps, low], light, HAND) == [False] * 4 + [True]  # the last row of the pads alone
    assert by_largest_torque([low, *grasps], light, HAND) == [*grasps, low]
    assert touch_narrowly(grasps, heavy, load_gripper("suction")) == [False] * 4
