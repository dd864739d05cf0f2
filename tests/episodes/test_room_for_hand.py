"""Where a hand with joints has room to close: a slab that lies leaves none, so that it begins on its edge."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.room_for_hand import (
    feasible_start_placements,
    handover_start_placements,
    placement_with_room,
    start_placements_with_room,
)
from manitwin.episodes.skills.registry import SKILLS
from manitwin.geometry.poses import transform
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.scenes.layouts.pool import PoolTwin, StandingPose
from rigid_boxes import box

HALF_M = np.array([0.045, 0.05, 0.015])
ON_EDGE = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # the slab's Y is up


def hand() -> MultiFingerGripper:
    found = load_gripper("allegro")
    assert isinstance(found, MultiFingerGripper)
    return found


def grasp(rotation: np.ndarray, at_m: list[float]) -> Grasp:
    """The hand across the slab's 3 cm, its middle at a place of the slab."""
    gripper = hand()
    joints = gripper.postures[0].joints_at(np.array([2 * HALF_M[2] + 2 * gripper.clearance_m, 0.02]))
    return Grasp("hand", transform(rotation, np.array(at_m)), 2 * HALF_M[2], joints)


DOWN_THE_SLAB = grasp(np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]), [0.0, HALF_M[1] + 0.045, 0.0])
"""Along -Y of the slab, closing across its thickness: from above where the slab stands on its edge."""
LYING = StandingPose(0, transform(None, np.array([0, 0, HALF_M[2]])), 0.7, 0.07, True)
STANDING = StandingPose(1, transform(ON_EDGE, np.array([0, 0, HALF_M[1]])), 0.2, 0.06)


def test_a_slab_begins_on_its_edge_where_fingers_have_no_room_beside_it_as_it_lies() -> None:
    approach = DOWN_THE_SLAB.gripper_to_object[:3, 2]
    np.testing.assert_allclose(approach, [0, -1, 0])
    assert placement_with_room([LYING, STANDING], [DOWN_THE_SLAB], hand()) is STANDING
    assert placement_with_room([LYING], [DOWN_THE_SLAB], hand()) is None


def test_the_likeliest_placement_with_room_is_taken_and_rare_ones_are_not() -> None:
    rare = StandingPose(2, STANDING.object_to_plane, 0.01, 0.06)
    likelier = StandingPose(3, STANDING.object_to_plane, 0.4, 0.06)
    assert placement_with_room([LYING, STANDING, likelier], [DOWN_THE_SLAB], hand()) is likelier
    assert placement_with_room([LYING, rare], [DOWN_THE_SLAB], hand()) is None
    assert placement_with_room([LYING, STANDING], [], hand()) is None


JAWS, LONG_M, WIDE_M = load_gripper("panda"), 0.13, 0.05
X_UP = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])
BAR = box([LONG_M, WIDE_M, WIDE_M], 0.2, 0.6)
FLAT = StandingPose(0, transform(None, np.array([0, 0, WIDE_M / 2])), 0.4, 0.05, upright=True)
ON_SIDE = StandingPose(1, transform(ON_EDGE, np.array([0, 0, WIDE_M / 2])), 0.4, 0.05)
ON_END = StandingPose(2, transform(X_UP, np.array([0, 0, LONG_M / 2])), 0.2, 0.05)


def jaws(approach: list[float], closing: list[float], x_m: float = 0.045) -> Grasp:
    """A grasp of the bar near its +X end, of which a hand beside the bar has room over the table when that end is up."""
    along, across = np.array(approach), np.array(closing)
    rotation = np.column_stack([across, np.cross(along, across), along])
    return Grasp("jaws", transform(rotation, np.array([x_m, 0, 0]) - JAWS.tip_depth_m * along), WIDE_M)


FROM_Y, FROM_Z = jaws([0, -1, 0], [0, 0, 1]), jaws([0, 0, -1], [0, 1, 0])


def test_a_bar_begins_where_a_grasp_leads_to_its_end_at_once_or_by_another_placement() -> None:
    def begins(*ways: StandingPose, grasps: tuple[Grasp, ...] = (FROM_Y, FROM_Z)) -> list[StandingPose]:
        return start_placements_with_room([ON_SIDE], [FLAT], ways, grasps, JAWS, BAR)

    assert begins(FLAT) == []  # from +Y it is lifted, from +Z it is laid flat: no grasp does both
    assert begins(FLAT, ON_END) == [ON_SIDE]
    assert begins(ON_END, grasps=(FROM_Y,)) == []
    assert start_placements_with_room([ON_END], [FLAT], (), (FROM_Y, FROM_Z), JAWS, BAR) == [ON_END]


def test_what_is_too_heavy_for_a_grasp_at_its_end_does_not_begin_lying() -> None:
    heavy = box([LONG_M, WIDE_M, WIDE_M], 2.0, 0.6)
    both = ([ON_SIDE], [ON_END], (), (FROM_Y,), JAWS)
    assert start_placements_with_room(*both, BAR) == [ON_SIDE]
    assert start_placements_with_room(*both, heavy) == []


def two_hands(*grasps: Grasp, begin: StandingPose = ON_SIDE, mass_kg: float = 0.2) -> list[StandingPose]:
    """The placements from which the bar is handed over, that it lies in on two sides."""
    return handover_start_placements(
        [begin], [ON_SIDE, FLAT], grasps, JAWS, box([LONG_M, WIDE_M, WIDE_M], mass_kg, 0.6)
    )


def test_a_bar_is_handed_over_where_one_hand_can_lift_and_another_beside_it_put_down() -> None:
    lifts, puts = FROM_Y, jaws([0, 0, -1], [0, 1, 0], -0.045)  # the second one lays it flat, on another side
    assert two_hands(lifts, puts) == [ON_SIDE]
    assert two_hands(lifts) == [], "one grasp is not of two hands"
    assert two_hands(lifts, jaws([0, 0, -1], [0, 1, 0], 0.01)) == [], "3.5 cm apart"
    assert two_hands(lifts, jaws([0, 0, -1], [0, 1, 0], 0.0)) == [ON_SIDE]
    assert two_hands(jaws([0, 1, 0], [0, 0, 1]), puts) == [], "from below nothing is lifted"
    assert two_hands(lifts, jaws([0, 1, 0], [0, 0, 1], -0.045)) == [], (
        "nor put down, but for the side that it never lies on"
    )
    assert two_hands(lifts, puts, mass_kg=2.0) == [], "too heavy for a hand at its end"


def test_only_what_takes_two_arms_asks_for_two_hands() -> None:
    bar = PoolTwin("t", "0", "bar", (ON_SIDE, FLAT), False, ())
    for skill, expected in (("handover", []), ("lift", None)):
        found = feasible_start_placements(SKILLS[skill], bar, BAR, lambda: [FROM_Y], JAWS)
        assert found == (SKILLS[skill].begins_in(bar) if expected is None else expected)
