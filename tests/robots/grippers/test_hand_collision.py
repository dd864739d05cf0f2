"""Separating axes against the volume of the intersection, as a boolean engine measures it."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.geometry.poses import transform
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.hand_clearance import HandCollision

PANDA = load_gripper("panda")
FROM_ABOVE = np.diag([1.0, -1.0, -1.0])


def above(tip_m: list[float]) -> np.ndarray:
    return transform(FROM_ABOVE, np.add(tip_m, [0, 0, PANDA.tip_depth_m]))


def overlaps(hulls: tuple[np.ndarray, ...], poses: np.ndarray, clearance_m: float = 0.0) -> np.ndarray:
    return HandCollision(hulls).overlaps(PANDA, poses, opening_m=PANDA.opening_m, clearance_m=clearance_m)


def shared_volume(vertices: np.ndarray, pose: np.ndarray) -> float:
    hull = manifold3d.Manifold.hull_points(vertices)
    total = 0.0
    for box_to_gripper, half in PANDA.boxes(PANDA.opening_m):
        box = manifold3d.Manifold.cube(2 * half, center=True).transform((pose @ box_to_gripper)[:3])
        total += (hull ^ box).volume()
    return total


def test_overlap_agrees_with_the_intersection_volume_over_random_poses() -> None:
    rng = np.random.default_rng(3)
    vertices = trimesh.creation.icosphere(subdivisions=2, radius=0.03).vertices * [1.2, 0.7, 1.0]
    rotations = Rotation.random(300, rng).as_matrix()
    poses = np.stack([transform(r, rng.uniform(-0.03, 0.03, 3) - r[:, 2] * rng.uniform(0.06, 0.16)) for r in rotations])
    ours = overlaps((vertices,), poses)
    truly = np.array([shared_volume(vertices, pose) > 1e-12 for pose in poses])
    assert 60 < truly.sum() < 240
    assert not (truly & ~ours).any(), "an overlap was missed"
    assert (ours & ~truly).sum() <= 6, "more false overlaps than edges by edges explain"


@pytest.mark.parametrize(("width_m", "clearance_m", "hit"), [(0.079, 0, False), (0.081, 0, True), (0.079, 0.001, True)])
def test_box_wider_than_the_opening_collides(width_m: float, clearance_m: float, hit: bool) -> None:
    box = np.array(trimesh.creation.box([width_m, 0.03, 0.03]).vertices)
    assert overlaps((box,), above([0, 0, 0])[None], clearance_m)[0] == hit


def test_palm_collides_with_a_tall_box() -> None:
    box = np.array(trimesh.creation.box([0.03, 0.03, 0.1]).vertices)
    # the palm ends 0.0374 m before the fingertips' centre
    poses = np.stack([above([0, 0, 0.05 - 0.036]), above([0, 0, 0.05 - 0.039])])
    assert overlaps((box,), poses).tolist() == [False, True]


def test_the_second_hull_counts_too() -> None:
    small = np.array(trimesh.creation.box([0.01, 0.01, 0.01]).vertices)
    assert overlaps((small, np.add(small, [0.05, 0, 0])), above([0, 0, 0])[None])[0]
    assert not overlaps((small, np.add(small, [0.15, 0, 0])), above([0, 0, 0])[None])[0]
