"""Hands above a supporting plane: how low they reach, and how far they are drawn back."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.geometry.poses import rotation_between, transform, transform_points
from manitwin.physics.grasp_filters import SUPPORT_CLEARANCE_M, lowest_points_m, raised
from manitwin.robots.grippers.gripper import load_gripper, of_kind
from manitwin.robots.grippers.parallel import ParallelGripper

PANDA = of_kind(load_gripper("panda"), ParallelGripper)
REACH_M = 0.1129  # the far end of the fingers in panda.toml
DOWN = rotation_between(np.array([0.0, 0, 1]), np.array([0.0, 0, -1]))


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
    back, index = raised(PANDA, poses, np.eye(4))
    assert index.tolist() == [0, 1]
    assert (lowest_points_m(PANDA, back, np.eye(4)) >= SUPPORT_CLEARANCE_M - 1e-9).all()
    moves = back[:, :3, 3] - poses[index, :3, 3]
    assert np.allclose(np.cross(moves, back[:, :3, 2]), 0)
    tips = [transform_points(pose, np.array([[0, 0, PANDA.tip_depth_m]]))[0, 2] for pose in back]
    assert tips[0] == pytest.approx(SUPPORT_CLEARANCE_M + REACH_M - PANDA.tip_depth_m)


def test_what_would_leave_nothing_between_the_pads_or_comes_from_the_side_is_left_out() -> None:
    sideways = rotation_between(np.array([0.0, 0, 1]), np.array([1.0, 0, 0]))
    poses = np.array([at_tip_height(-0.02), at_tip_height(0.004, sideways)])
    assert len(raised(PANDA, poses, np.eye(4))[1]) == 0
