"""Distances and octants of grasps placed by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manitwin.geometry.grasp_diversity import approach_octants, farthest_grasps, fingertips
from manitwin.geometry.poses import transform

DEPTH_M = 0.1


def grasp(tip: list[float], rotation: np.ndarray | None = None) -> np.ndarray:
    rotation = np.eye(3) if rotation is None else rotation
    return transform(rotation, np.array(tip) - DEPTH_M * rotation[:, 2])


def test_fingertips_lie_along_the_approach() -> None:
    turned = Rotation.from_euler("y", 90, degrees=True).as_matrix()
    assert fingertips(np.stack([grasp([0.1, 0.2, 0.3], turned)]), np.array([DEPTH_M])) == pytest.approx(
        np.array([[0.1, 0.2, 0.3]])
    )


def test_farthest_grasps_are_the_ends_of_a_row_and_then_its_middle() -> None:
    row = np.stack([grasp([x, 0, 0]) for x in np.linspace(0, 0.1, 11)])
    assert farthest_grasps(row, np.full(11, DEPTH_M), 3).tolist() == [0, 10, 5]


def test_half_turn_about_the_approach_is_the_same_grasp() -> None:
    half, quarter = (Rotation.from_euler("z", angle, degrees=True).as_matrix() for angle in (180, 90))
    poses = np.stack([grasp([0, 0, 0]), grasp([0, 0, 0], half), grasp([0.001, 0, 0]), grasp([0, 0, 0], quarter)])
    assert farthest_grasps(poses, np.full(4, DEPTH_M), 3).tolist() == [0, 3, 2]


def test_no_grasp_is_chosen_twice_and_few_are_all_kept() -> None:
    same = np.stack([grasp([0, 0, 0])] * 6)
    assert sorted(farthest_grasps(same, np.full(6, DEPTH_M), 4)) == [0, 1, 2, 3]
    assert farthest_grasps(same, np.full(6, DEPTH_M), 9).tolist() == list(range(6))


def test_octants_are_the_signs_of_the_approach_direction() -> None:
    signs = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    turned = [Rotation.align_vectors([sign], [[0, 0, 1]])[0].as_matrix() for sign in signs]
    octants = approach_octants(np.stack([grasp([0, 0, 0], rotation) for rotation in turned]))
    assert sorted(octants) == list(range(8))
    assert octants[-1] == 7
