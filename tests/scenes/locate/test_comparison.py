"""Scores and alignment of poses that are known."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.geometry.poses import rotation_angle_rad, transform
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.pose_scoring import PixelSamples, refine_poses, score_poses
from manitwin.scenes.locate.registration import align
from manitwin.scenes.locate.search import hill_climb
from seen_solids import seen_from

TOLERANCE_M = 0.006


def moved(pose: np.ndarray, *, by_m: tuple[float, float, float]) -> np.ndarray:
    """Move a pose in the camera's frame."""
    return np.asarray(transform(translation=np.array(by_m)) @ pose)


def test_the_true_pose_explains_all_and_less_the_farther_it_is_off(stool: PoseModel) -> None:
    seen = seen_from(stool, 0.6, noise=False)
    evidence = PixelSamples.sample(seen.view, seen.mask, 200, 4000, np.random.default_rng(0))
    true = seen.object_to_camera
    poses = np.array([true, *(moved(true, by_m=(0, 0, z)) for z in (0.003, -0.003, 0.006))])
    scores = score_poses(stool, poses, evidence, TOLERANCE_M)
    # 3 mm of 6 cost a quarter where the surface looks at the camera: 1 - (3 / 6)^2
    assert scores[0] > 0.995 and abs(scores[1] - 0.75) < 0.05 and abs(scores[2] - 0.75) < 0.05 and scores[3] < 0.1


def test_what_stands_before_what_is_seen_counts_against_and_what_is_hidden_does_not(
    stool: PoseModel,
) -> None:
    whole, half = seen_from(stool, 0.6, noise=False), seen_from(stool, 0.6, hidden_right=0.5, noise=False)
    hidden = PixelSamples.sample(half.view, half.mask, 200, 4000, np.random.default_rng(0))
    assert score_poses(stool, half.object_to_camera[None], hidden, TOLERANCE_M)[0] > 0.99
    cut = whole.mask & half.mask  # the other half is seen, and is no part of the thing: a smaller one
    behind = whole.view.depth_m.copy()
    behind[whole.mask & ~half.mask] = 1.5
    free = PixelSamples.sample(
        type(whole.view)(behind, whole.view.intrinsics), cut, 200, 4000, np.random.default_rng(0)
    )
    assert abs(score_poses(stool, whole.object_to_camera[None], free, TOLERANCE_M)[0] - 0.5) < 0.03


def test_alignment_undoes_a_known_motion(stool: PoseModel) -> None:
    seen = seen_from(stool, 0.6, noise=False)
    true = seen.object_to_camera
    turn = trimesh.transformations.rotation_matrix(0.12, [1, 2, 3], stool.center)
    start = moved(true @ turn, by_m=(0.006, -0.004, 0.005))
    pixels = np.flatnonzero(seen.mask)[::7]
    found = align(seen.view.points(pixels), stool.surface, start[None], iterations=25, kept_share=0.95)
    evidence = PixelSamples.sample(seen.view, seen.mask, 200, 1500, np.random.default_rng(0))
    finer = refine_poses(stool, found, evidence, 0.004, 10)[0]
    off = np.linalg.inv(true) @ finer
    assert rotation_angle_rad(off[:3, :3]) < 0.01 and np.linalg.norm(off[:3, 3]) < 0.001


def test_a_pose_beside_the_true_one_climbs_back_and_none_explains_less_than_before(stool: PoseModel) -> None:
    seen = seen_from(stool, 0.6, hidden_right=0.5)
    evidence = PixelSamples.sample(seen.view, seen.mask, 200, 800, np.random.default_rng(0))
    true = seen.object_to_camera
    starts = np.array([moved(true, by_m=(0.005, -0.003, 0.004)), moved(true, by_m=(0.0, 0.008, 0.0)), true])
    before = score_poses(stool, starts, evidence, TOLERANCE_M)
    after = hill_climb(stool, starts, evidence, TOLERANCE_M)
    scores = score_poses(stool, after, evidence, TOLERANCE_M)
    assert (scores >= before).all() and (scores[:2] > before[:2] + 0.1).all()
    off_m = np.linalg.norm(after[:2, :3, 3] - true[:3, 3], axis=1)
    assert off_m.max() < 0.004
