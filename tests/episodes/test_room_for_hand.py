"""Where a hand with joints has room to close: a slab that lies leaves none, so that it begins on its edge."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.room_for_hand import placement_with_room
from manitwin.geometry.poses import transform
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.scenes.layouts.pool import StandingPose

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
