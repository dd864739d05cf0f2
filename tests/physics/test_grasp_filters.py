"""The filters on a box, and the choice among grasps whose merits are known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.geometry.grasp_diversity import approach_octants
from manitwin.geometry.poses import transform
from manitwin.physics.grasp_filters import GraspFilter, PadContacts, pad_merits, torque_ratio
from manitwin.physics.grasp_selection import select_likely
from manitwin.robots.grippers.gripper import load_gripper

PANDA = load_gripper("panda")


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


def test_torque_ratio_is_one_where_friction_just_holds_the_weight() -> None:
    # m (g + a) l = 2 mu F r: 0.05 m from the axis, 2 * 0.75 * 50 N * 7 mm
    mass_kg = 2 * 0.75 * 50 * 0.007 / (0.05 * (9.81 + 3.6))
    assert torque_ratio(np.array([0.05]), mass_kg=mass_kg, force_n=50, friction=0.75) == pytest.approx(1)


def cloud(count: int, directions: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    poses = []
    for number in range(count):
        turn = Rotation.align_vectors([directions[number % len(directions)]], [[0, 0, 1]])[0].as_matrix()
        poses.append(transform(turn, rng.uniform(-0.05, 0.05, 3)))
    return np.stack(poses)


def contacts(lever_m: np.ndarray, cells: np.ndarray) -> PadContacts:
    count = len(lever_m)
    return PadContacts(np.full(count, 0.03), cells, np.zeros(count), np.ones(count), lever_m)


def test_selection_prefers_short_levers_and_large_contacts() -> None:
    rng = np.random.default_rng(4)
    lever, cells = np.tile([0.01, 0.2], 200), np.repeat([6, 2], 200)
    poses = cloud(400, rng.normal(size=(50, 3)), rng)
    chosen = select_likely(poses, np.full(400, 0.1), pad_merits(contacts(lever, cells), lever / 0.2), 50)
    assert len(np.unique(chosen)) == 50
    assert (lever[chosen] < 0.05).all()
    assert (cells[chosen] >= 3).all()


def test_selection_fills_up_with_the_next_best_where_few_are_good() -> None:
    rng = np.random.default_rng(5)
    lever = np.concatenate([np.full(10, 0.01), np.linspace(0.1, 0.3, 90)])
    poses = cloud(100, rng.normal(size=(50, 3)), rng)
    ratio = np.where(lever < 0.05, 0.1, 2.0)
    chosen = select_likely(poses, np.full(100, 0.1), pad_merits(contacts(lever, np.full(100, 6)), ratio), 30)
    assert chosen.tolist() == list(range(30))


def test_selection_points_into_four_octants_where_there_are_four() -> None:
    rng = np.random.default_rng(6)
    directions = np.array([[1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1.0]])
    poses = cloud(400, directions, rng)
    octants = approach_octants(poses)
    lever = np.where(octants == octants[0], 0.01, 0.15)  # all the good ones in one octant
    chosen = select_likely(poses, np.full(400, 0.1), pad_merits(contacts(lever, np.full(400, 6)), lever / 0.1), 60)
    assert len(np.unique(octants[chosen])) == 4
    assert (octants[chosen] == octants[0]).sum() >= 30
