"""Frames of the served hands, against the meshes of the Franka hand from another distribution."""

from __future__ import annotations

from importlib.metadata import files
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.models.graspers.served_proposals import BASE_LINK_Z_M, HANDS, gripper_poses
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.parallel import ParallelGripper

PANDA = load_gripper("panda")
assert isinstance(PANDA, ParallelGripper)
# Of GraspGen's own hand.stl, in its base link's frame.
GRASPGEN_HAND_X_M, GRASPGEN_HAND_Y_M = (-0.100, 0.104), (-0.032, 0.032)
GRASPGEN_FINGERS_Z_M, GRASPGEN_DEPTH_M = 0.0584, 0.10527314
TURN = Rotation.from_euler("z", 90, degrees=True).as_matrix()  # from the URDF's panda_hand, which closes along Y


def franka_mesh(name: str) -> np.ndarray:
    [file] = [
        f for f in files("example-robot-data") or () if str(f).endswith(f"panda_description/meshes/collision/{name}")
    ]
    return np.asarray(trimesh.load_mesh(Path(str(file.locate()))).vertices)


def pad_points_m() -> np.ndarray:
    """The flat inner face at the end of a closed finger, in GraspGen's base link frame."""
    finger = franka_mesh("finger.stl")
    inner = finger[np.abs(finger[:, 1]) < 0.0005]
    return (inner @ TURN.T) + [0, 0, GRASPGEN_FINGERS_Z_M]


def random_poses(count: int) -> np.ndarray:
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Rotation.random(count, rng=1).as_matrix()
    poses[:, :3, 3] = np.random.default_rng(1).normal(0, 0.2, (count, 3))
    return poses


def test_the_hand_of_the_model_is_the_franka_hand_about_the_same_origin() -> None:
    hand = franka_mesh("hand.stl") @ TURN.T
    assert hand[:, 0].min() == pytest.approx(GRASPGEN_HAND_X_M[0], abs=1e-3)
    assert hand[:, 0].max() == pytest.approx(GRASPGEN_HAND_X_M[1], abs=1e-3)
    assert hand[:, 1].min() == pytest.approx(GRASPGEN_HAND_Y_M[0], abs=1e-3)
    assert hand[:, 1].max() == pytest.approx(GRASPGEN_HAND_Y_M[1], abs=1e-3)


def test_our_pads_are_where_the_fingers_of_that_hand_end() -> None:
    half_y, half_z = PANDA.pad_half_extents_m
    pad = pad_points_m()
    assert pad[:, 2].max() == pytest.approx(PANDA.tip_depth_m + half_z, abs=0.8e-3)
    assert np.abs(pad[:, 1]).max() == pytest.approx(half_y, abs=2e-3)
    # had the pads' centre been moved to the model's own depth, they would stick out beyond the finger
    assert GRASPGEN_DEPTH_M + half_z > pad[:, 2].max() + 1.5e-3


def test_a_converted_grasp_puts_our_pads_where_the_model_put_its_fingertips() -> None:
    poses = random_poses(50)
    converted = gripper_poses(poses.astype(np.float32), BASE_LINK_Z_M[HANDS["panda"]])
    tip = pad_points_m()[:, 2].max()
    theirs = poses[:, :3, :3] @ [PANDA.opening_m / 2, 0, tip] + poses[:, :3, 3]
    ours_m = [PANDA.opening_m / 2, 0, PANDA.tip_depth_m + PANDA.pad_half_extents_m[1]]
    ours = converted[:, :3, :3] @ ours_m + converted[:, :3, 3]
    assert np.linalg.norm(ours - theirs, axis=1).max() < 1e-3


def test_every_hand_is_one_of_a_gripper_that_is_shipped() -> None:
    assert set(HANDS.values()) == set(BASE_LINK_Z_M)
    assert all(isinstance(load_gripper(name), ParallelGripper) for name in HANDS)


def test_rotations_become_exact_and_the_last_row_is_set() -> None:
    poses = random_poses(100).astype(np.float32)
    poses[:, 3, 3] = 0.9999
    converted = gripper_poses(poses)
    rotation = converted[:, :3, :3]
    assert np.abs(rotation @ np.swapaxes(rotation, 1, 2) - np.eye(3)).max() < 1e-14
    assert np.abs(converted[:, :3] - poses[:, :3]).max() < 1e-6
    assert (converted[:, 3] == [0, 0, 0, 1]).all()


def test_a_base_link_farther_out_moves_grasps_back() -> None:
    poses = random_poses(10)
    moved = gripper_poses(poses, base_link_z_m=0.01)
    # the point 1 cm along our +Z is the model's origin
    assert np.einsum("nij,j->ni", moved, [0, 0, 0.01, 1])[:, :3] == pytest.approx(poses[:, :3, 3])


@pytest.mark.parametrize("spoil", ["reflected", "scaled", "sheared", "not_finite", "flat"])
def test_what_is_no_pose_is_refused(spoil: str) -> None:
    poses = random_poses(3)
    if spoil == "reflected":
        poses[1, :3, 0] *= -1
    elif spoil == "scaled":
        poses[1, :3, :3] *= 1.1
    elif spoil == "sheared":
        poses[1, :3, 0] += 0.1 * poses[1, :3, 1]
    elif spoil == "not_finite":
        poses[1, 0, 3] = np.nan
    else:
        poses = poses[:, :3]
    with pytest.raises(ValueError, match="poses"):
        gripper_poses(poses)


def test_no_poses_are_no_poses() -> None:
    assert gripper_poses(np.empty((0, 4, 4), np.float32)).shape == (0, 4, 4)
