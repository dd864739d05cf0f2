"""The pads' contacts, the filters and the clearance of a support in closed form, and the choice among grasps of known merits."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.geometry.grasp_diversity import approach_octants
from manitwin.geometry.poses import rotation_between, transform, transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.physics.grasp_filters import (
    ACROSS,
    ALONG,
    INSET,
    SUPPORT_CLEARANCE_M,
    GraspFilter,
    PadContacts,
    lowest_points_m,
    pad_contacts,
    pad_merits,
    retract_from_plane,
)
from manitwin.physics.grasp_selection import select_likely
from manitwin.physics.pad_loads import PressedPads
from manitwin.robots.grippers.gripper import load_gripper, require_kind
from manitwin.robots.grippers.parallel import ParallelGripper

PANDA = require_kind(load_gripper("panda"), ParallelGripper)
FROM_ABOVE = np.diag([1.0, -1.0, -1.0])
REACH_M = 0.1129  # the far end of the fingers in panda.toml
DOWN = rotation_between(np.array([0.0, 0, 1]), np.array([0.0, 0, -1]))


def contacts_at(tip_m: list[float], extents_m: list[float], center_of_mass_m: list[float]) -> PadContacts:
    pose = transform(FROM_ABOVE, np.add(tip_m, [0, 0, PANDA.tip_depth_m]))
    caster = RayCaster(trimesh.creation.box(extents_m))
    return pad_contacts(PANDA, pose[None], caster, np.array(center_of_mass_m))


def test_pads_on_a_box_touch_with_all_cells_as_far_apart_as_it_is_wide() -> None:
    contacts = contacts_at([0, 0, 0], [0.04, 0.06, 0.05], [0, 0, 0])
    assert contacts.width_m[0] == pytest.approx(0.04, abs=1e-6)
    assert contacts.cells[0] == ACROSS * ALONG
    assert contacts.offset_m[0] == pytest.approx(0, abs=1e-9)
    assert contacts.alignment[0] == pytest.approx(1)


def test_lever_is_the_distance_of_the_center_of_mass_from_the_closing_line() -> None:
    assert contacts_at([0, 0, 0], [0.04, 0.06, 0.05], [0.01, 0.03, -0.04]).lever_m[0] == pytest.approx(0.05)


def test_pads_at_the_edge_touch_with_fewer_cells() -> None:
    # the middle row of rays and one beside it, of three, lie over the box
    contacts = contacts_at([0, 0.028, 0], [0.04, 0.06, 0.05], [0, 0, 0])
    assert contacts.cells[0] == 2 * ALONG
    half_y, half_z = (INSET * half for half in PANDA.pad_half_extents_m)
    assert contacts.pads.most_apart_m[0] == pytest.approx([half_y, 2 * half_z])  # along Y from one row to the next
    assert contacts.pads.least_apart_m[0] == pytest.approx([-half_y, -2 * half_z])


def test_pads_press_around_the_middle_of_what_they_hold_wherever_it_is_in_the_open_hand() -> None:
    contacts = contacts_at([0.01, 0, 0], [0.04, 0.06, 0.05], [0, 0, 0])
    assert contacts.pads.middle_m[0] == pytest.approx([-0.01, 0, PANDA.tip_depth_m], abs=1e-6)
    assert contacts.pads.width_m[0] == pytest.approx(0.04, abs=1e-6)


def test_selection_counts_a_load_twice_as_much_as_a_lever_and_calls_none_fit_that_asks_for_more_than_half() -> None:
    merits = pad_merits(
        contacts(np.array([0.0, 0.1, 0.05]), np.array([6, 6, 6])), np.array([0.5, 0.0, 0.6]), np.zeros(3, bool)
    )
    assert merits.cost[:2] == pytest.approx([1, 1])
    assert merits.fit.tolist() == [True, True, False]


def test_pads_in_the_air_have_no_width() -> None:
    contacts = contacts_at([0, 0, 0.1], [0.04, 0.06, 0.05], [0, 0, 0])
    assert np.isinf(contacts.width_m[0])
    assert contacts.cells[0] == 0


def test_slanted_faces_are_told_by_their_alignment() -> None:
    wedge = trimesh.creation.cone(radius=0.03, height=0.03, sections=256)  # 45 degrees all around
    pose = transform(FROM_ABOVE, [0, 0, 0.012 + PANDA.tip_depth_m])
    contacts = pad_contacts(PANDA, pose[None], RayCaster(wedge), np.zeros(3))
    assert contacts.alignment[0] == pytest.approx(np.sqrt(0.5), abs=0.05)


def test_filter_keeps_the_grasp_on_the_faces_and_drops_air_edges_and_collisions() -> None:
    box = np.array(trimesh.creation.box([0.04, 0.06, 0.1]).vertices)
    from_above = np.diag([1.0, -1.0, -1.0])
    on_edges = from_above @ Rotation.from_euler("z", 45, degrees=True).as_matrix()

    def at(rotation: np.ndarray, z: float) -> np.ndarray:
        return transform(rotation, np.array([0, 0, z + PANDA.tip_depth_m]))

    poses = np.stack([at(from_above, 0.03), at(from_above, 0.2), at(on_edges, 0.03), at(from_above, 0)])
    left = GraspFilter(PANDA, (box,), np.zeros(3), friction=0.75)(poses)
    assert left.index.tolist() == [0]
    assert left.after_pad == 2
    assert left.contacts.width_m[0] == pytest.approx(0.04, abs=1e-6)


def cloud(count: int, directions: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    poses = []
    for number in range(count):
        turn = Rotation.align_vectors([directions[number % len(directions)]], [[0, 0, 1]])[0].as_matrix()
        poses.append(transform(turn, rng.uniform(-0.05, 0.05, 3)))
    return np.stack(poses)


def contacts(lever_m: np.ndarray, cells: np.ndarray) -> PadContacts:
    count = len(lever_m)
    width_m, apart_m = np.full(count, 0.03), np.full((count, 2), 0.016)
    pads = PressedPads(np.zeros((count, 3)), width_m, -apart_m, apart_m, np.ones(count))
    return PadContacts(width_m, cells, np.full(count, 0.01), np.zeros(count), np.ones(count), lever_m, pads, pads)


def test_selection_prefers_short_levers_and_large_contacts() -> None:
    rng = np.random.default_rng(4)
    lever, cells = np.tile([0.01, 0.2], 200), np.repeat([6, 2], 200)
    poses = cloud(400, rng.normal(size=(50, 3)), rng)
    chosen = select_likely(
        poses, np.full(400, 0.1), pad_merits(contacts(lever, cells), lever / 0.2, np.zeros(400, bool)), 50
    )
    assert len(np.unique(chosen)) == 50
    assert (lever[chosen] < 0.05).all()
    assert (cells[chosen] >= 3).all()


def test_selection_fills_up_with_the_next_best_where_few_are_good() -> None:
    rng = np.random.default_rng(5)
    lever = np.concatenate([np.full(10, 0.01), np.linspace(0.1, 0.3, 90)])
    poses = cloud(100, rng.normal(size=(50, 3)), rng)
    ratio = np.where(lever < 0.05, 0.1, 2.0)
    chosen = select_likely(
        poses, np.full(100, 0.1), pad_merits(contacts(lever, np.full(100, 6)), ratio, np.zeros(100, bool)), 30
    )
    assert chosen.tolist() == list(range(30))


def test_selection_points_into_four_octants_where_there_are_four() -> None:
    rng = np.random.default_rng(6)
    directions = np.array([[1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1.0]])
    poses = cloud(400, directions, rng)
    octants = approach_octants(poses)
    lever = np.where(octants == octants[0], 0.01, 0.15)  # all the good ones in one octant
    chosen = select_likely(
        poses, np.full(400, 0.1), pad_merits(contacts(lever, np.full(400, 6)), lever / 0.1, np.zeros(400, bool)), 60
    )
    assert len(np.unique(octants[chosen])) == 4
    assert (octants[chosen] == octants[0]).sum() >= 30


def at_tip_height(height_m: float, rotation: np.ndarray = DOWN) -> np.ndarray:
    """A hand whose fingertips' centre is above the origin."""
    return transform(rotation, np.array([0, 0, height_m]) - PANDA.tip_depth_m * rotation[:, 2])


def test_a_hand_that_points_down_reaches_to_the_ends_of_its_pads() -> None:
    poses = np.array([at_tip_height(0.1), at_tip_height(0.0)])
    assert lowest_points_m(PANDA, poses, np.eye(4)) == pytest.approx(np.array([0.1, 0.0]) + PANDA.tip_depth_m - REACH_M)


def test_the_plane_may_be_anywhere_in_the_objects_frame() -> None:
    object_to_plane = transform(
        rotation_between(np.array([1.0, 0, 0]), np.array([0.0, 0, 1])), np.array([0.2, 0.1, 0.05])
    )
    pose = np.linalg.inv(object_to_plane) @ at_tip_height(0.02)
    assert lowest_points_m(PANDA, pose[None], object_to_plane)[0] == pytest.approx(0.02 + PANDA.tip_depth_m - REACH_M)


def test_a_low_hand_is_drawn_back_along_its_approach_until_it_is_clear() -> None:
    tilted = rotation_between(np.array([0.0, 0, 1]), np.array([0.0, 0.5, -1]) / np.hypot(0.5, 1))
    poses = np.array([at_tip_height(0.004), at_tip_height(0.004, tilted), at_tip_height(0.05)])
    back, index = retract_from_plane(PANDA, poses, np.eye(4))
    assert index.tolist() == [0, 1]
    assert (lowest_points_m(PANDA, back, np.eye(4)) >= SUPPORT_CLEARANCE_M - 1e-9).all()
    moves = back[:, :3, 3] - poses[index, :3, 3]
    assert np.allclose(np.cross(moves, back[:, :3, 2]), 0)
    tips = [transform_points(pose, np.array([[0, 0, PANDA.tip_depth_m]]))[0, 2] for pose in back]
    assert tips[0] == pytest.approx(SUPPORT_CLEARANCE_M + REACH_M - PANDA.tip_depth_m)


def test_what_would_leave_nothing_between_the_pads_or_comes_from_the_side_is_left_out() -> None:
    sideways = rotation_between(np.array([0.0, 0, 1]), np.array([1.0, 0, 0]))
    poses = np.array([at_tip_height(-0.02), at_tip_height(0.004, sideways)])
    assert len(retract_from_plane(PANDA, poses, np.eye(4))[1]) == 0
