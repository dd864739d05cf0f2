"""The weight of what is lifted and the friction of two pads: which grasps bear it about the axis of the jaws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from manitwin.episodes.grasp_stability import (
    LIFTED_WEIGHT,
    any_orientation_loads,
    bears_weight,
    contact_shares,
    has_narrow_contact,
    stable_along_path,
    stable_grasp_tiers,
    torsion_limits_nm,
    weight_torque_nm,
)
from manitwin.episodes.planning.problem import Grasp
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


def test_what_bears_a_weight_at_rest_alone_does_not_bear_to_lift_it() -> None:
    line_nm, face_nm = torsion_limits_nm(HAND)
    heavy, weight_n = bar(0.5), 0.5 * 9.81
    at_rest, lifted = held_at(0.95 * line_nm / weight_n), held_at(0.8 * line_nm / weight_n)
    assert weight_torque_nm(at_rest, heavy, HAND) < line_nm
    assert [bears_weight(grasp, heavy, HAND) for grasp in (at_rest, lifted)] == [False, True]
    assert stable_grasp_tiers([at_rest, lifted], heavy, HAND) == [(lifted,), (at_rest,)]
    assert stable_grasp_tiers([held_at(0.95 * face_nm / weight_n)], heavy, HAND) == []


def test_grasps_near_the_middle_come_first_and_those_that_cannot_bear_it_not_at_all() -> None:
    line_nm, face_nm = torsion_limits_nm(HAND)
    heavy, weight_n = bar(0.5), LIFTED_WEIGHT * 0.5 * 9.81
    light, doubtful, end = 0.5 * line_nm / weight_n, (line_nm + face_nm) / 2 / weight_n, 1.01 * face_nm / weight_n
    grasps = [held_at(x) for x in (end, doubtful, light, 0.0)]
    assert stable_grasp_tiers(grasps, heavy, HAND) == [(grasps[2], grasps[3]), (grasps[1],)]
    assert [bears_weight(grasp, heavy, HAND) for grasp in grasps] == [False, False, True, True]
    assert stable_grasp_tiers(grasps, bar(0.05), HAND) == [tuple(grasps)]
    assert stable_grasp_tiers(grasps[:1], heavy, HAND) == []


def test_other_grippers_keep_the_order_of_their_grasps() -> None:
    grasps = [held_at(x) for x in (0.14, 0.0)]
    for name in ("suction", "allegro"):
        assert stable_grasp_tiers(grasps, bar(2.0), load_gripper(name)) == [tuple(grasps)]
        assert bears_weight(grasps[0], bar(2.0), load_gripper(name))
        assert stable_grasp_tiers([], bar(2.0), load_gripper(name)) == []


def test_what_stands_safely_in_the_jaws_may_turn_in_them_as_it_is_tilted() -> None:
    """A bar of 1 kg on end hangs below the jaws; tilted by 90 degrees it bears on them with its whole lever."""
    on_end = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])
    upright, level = transform(on_end), np.eye(4)
    grasps = [held_at(0.1), held_at(0.04), held_at(0.0)]  # 1, 0.4 and 0 Nm; a line bears 0.44
    stands = bar(1.0, on_end)
    assert stable_grasp_tiers(grasps, stands, HAND) == [tuple(grasps)]
    assert stable_along_path(grasps, stands.body, [np.array([upright])], HAND) == grasps
    assert stable_along_path(grasps, stands.body, [np.array([upright, level])], HAND) == grasps[1:]
    gentle = np.array([upright])
    assert stable_along_path(grasps, stands.body, [np.array([upright, level]), gentle], HAND) == grasps, (
        "the gentlest way"
    )
    suction = load_gripper("suction")
    assert stable_along_path(grasps, stands.body, [np.array([level])], suction) == grasps


def raised(grasp: Grasp, by_m: float) -> Grasp:
    """The same grasp, its pads higher up the bar, so that fewer of their rows touch it."""
    return replace(grasp, gripper_to_object=grasp.gripper_to_object @ transform(None, np.array([0, 0, -by_m])))


def test_part_of_the_pads_lifts_what_a_disc_of_its_area_bears() -> None:
    line_nm, face_nm = torsion_limits_nm(HAND)
    heavy, weight_n, disc_nm = bar(0.5), LIFTED_WEIGHT * 0.5 * 9.81, face_nm * np.sqrt(0.6)
    assert line_nm < disc_nm
    below, above_it = (held_at(nm / weight_n) for nm in ((line_nm + disc_nm) / 2, (disc_nm + face_nm) / 2))
    parts = [raised(each, 0.018) for each in (below, above_it)]  # of the cells of their pads 9 of 15 touch
    assert contact_shares([below, *parts], heavy.body, HAND) == [1.0, 0.6, 0.6]
    assert stable_grasp_tiers([below, above_it, *parts], heavy, HAND) == [(below, above_it, parts[0])]


def test_pads_that_touch_narrowly_lift_no_more_than_a_line_bears() -> None:
    line_nm, face_nm = torsion_limits_nm(HAND)
    heavy, weight_n = bar(0.5), LIFTED_WEIGHT * 0.5 * 9.81
    between, light = held_at((line_nm + face_nm) / 2 / weight_n), held_at(0.5 * line_nm / weight_n)
    narrow = [raised(each, 0.026) for each in (between, light)]
    assert has_narrow_contact([between, light, *narrow], heavy.body, HAND) == [False, False, True, True]
    assert stable_grasp_tiers([between, light, *narrow], heavy, HAND) == [(light, narrow[1]), (between,)]
    assert stable_grasp_tiers(narrow[:1], heavy, HAND) == []


def test_what_is_held_any_way_up_loads_a_grasp_by_its_lever_and_by_how_little_of_the_pads_touches() -> None:
    line_nm, _ = torsion_limits_nm(HAND)
    body = bar(0.5).body
    grasps = [held_at(x) for x in (0.06, 0.0, 0.03)]
    assert any_orientation_loads(grasps, body, HAND) == [int(10 * x * 0.5 * 9.81 / line_nm) for x in (0.06, 0.0, 0.03)]
    upright = Grasp("upright", above([0.12, 0, 0.0]), 0.04)  # its closing axis leads through the middle
    assert any_orientation_loads([upright], body, HAND) == [0]
    low = raised(held_at(0.06), 0.026)
    assert has_narrow_contact([grasps[0], low], body, HAND) == [False, True]
    whole, less = any_orientation_loads([grasps[0], low], body, HAND)
    assert whole is not None
    assert less is not None
    assert less >= 5 * whole, "a fifth of the pads touches"


def test_a_grasp_does_not_bear_any_way_up_more_than_its_pads_do_on_what_they_touch() -> None:
    line_nm, face_nm = torsion_limits_nm(HAND)
    body, weight_n = bar(0.5).body, 0.5 * 9.81
    line_m, face_m = line_nm / weight_n, face_nm / weight_n
    between = held_at((line_m + face_m) / 2)
    assert any_orientation_loads([held_at(1.02 * face_m)], body, HAND) == [None]
    assert any_orientation_loads([between], body, HAND)[0] is not None
    assert any_orientation_loads([raised(between, 0.026)], body, HAND) == [None], "narrow pads bear as a line does"
    assert any_orientation_loads([raised(held_at(0.8 * line_m), 0.026)], body, HAND)[0] is not None
    assert any_orientation_loads([], body, HAND) == []
    assert any_orientation_loads([between], body, load_gripper("suction")) == [0]


def test_pads_that_touch_by_a_corner_alone_bear_nothing_however_light_it_is() -> None:
    light, a_fifth_nm = bar(0.01).body, torsion_limits_nm(HAND)[0] / 5
    by_a_row, by_a_column = raised(held_at(0.14), 0.026), raised(held_at(0.153), 0.024)
    by_a_corner, beside = raised(held_at(0.146), 0.026), held_at(0.2)
    loads = any_orientation_loads([by_a_row, by_a_column, by_a_corner, beside], light, HAND)
    of_a_row = int(10 * 0.14 * 0.01 * 9.81 / a_fifth_nm)
    of_a_column = int(10 * 0.153 * 0.01 * 9.81 / (a_fifth_nm * 2 / 3))
    assert loads == [of_a_row, of_a_column, None, None]
