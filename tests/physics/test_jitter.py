"""Jittered grasps: how far they are moved, and about which point they are turned."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manitwin.geometry.grasp_diversity import fingertips
from manitwin.geometry.poses import transform
from manitwin.physics.robustness import jittered

MANY = 20_000
DEPTH_M = 0.1034


def poses(count: int) -> np.ndarray:
    rng = np.random.default_rng(11)
    turns = Rotation.random(count, random_state=rng).as_matrix()
    return np.stack([transform(turn, move) for turn, move in zip(turns, rng.normal(0, 0.1, (count, 3)), strict=True)])


def moved(before: np.ndarray, seed: int, sigma_deg: float, sigma_m: float) -> np.ndarray:
    depth_m = np.full(len(before), DEPTH_M)
    return jittered(before, depth_m, np.random.default_rng(seed), sigma_deg=sigma_deg, sigma_m=sigma_m)


def test_fingertips_move_by_a_normal_deviate_on_each_axis_of_the_object() -> None:
    before = poses(MANY)
    depth_m = np.full(MANY, DEPTH_M)
    shift = fingertips(moved(before, 0, 20.0, 0.012), depth_m) - fingertips(before, depth_m)
    # of the mean 0.012 / sqrt(20,000), of the deviation 0.012 / sqrt(40,000): four of these
    assert shift.mean(0) == pytest.approx(0, abs=4 * 0.012 / np.sqrt(MANY))
    assert shift.std(0) == pytest.approx(0.012, abs=4 * 0.012 / np.sqrt(2 * MANY))
    assert np.corrcoef(shift.T) == pytest.approx(np.eye(3), abs=4 / np.sqrt(MANY))
    kurtosis = (shift**4).mean(0) / (shift**2).mean(0) ** 2
    assert kurtosis == pytest.approx(3, abs=0.15), "a normal distribution has 3, a uniform one 1.8"


def test_turns_are_normal_deviates_about_each_axis_of_the_gripper() -> None:
    before = poses(MANY)
    turns = np.swapaxes(before[:, :3, :3], 1, 2) @ moved(before, 0, 20.0, 0.012)[:, :3, :3]
    angles_deg = Rotation.from_matrix(turns).as_euler("xyz", degrees=True)
    usual = np.abs(angles_deg[:, 1]) < 85  # beyond, Euler angles are those of another turn
    assert usual.mean() > 0.999
    assert angles_deg[usual].mean(0) == pytest.approx(0, abs=4 * 20 / np.sqrt(MANY))
    assert angles_deg[usual].std(0) == pytest.approx(20, abs=0.5)


def test_turning_alone_leaves_the_fingertips_where_they_are() -> None:
    before = poses(50)
    after = moved(before, 3, 20.0, 0.0)
    depth_m = np.full(50, DEPTH_M)
    assert fingertips(after, depth_m) == pytest.approx(fingertips(before, depth_m), abs=1e-12)
    assert np.linalg.norm(after[:, :3, 3] - before[:, :3, 3], axis=1).min() > 0.001, "the wrist moves"
    assert np.linalg.det(after[:, :3, :3]) == pytest.approx(1)


def test_moving_alone_does_not_turn_and_no_spread_changes_nothing() -> None:
    before = poses(5)
    assert moved(before, 3, 0.0, 0.01)[:, :3, :3] == pytest.approx(before[:, :3, :3], abs=1e-12)
    assert moved(before, 3, 0.0, 0.0) == pytest.approx(before, abs=1e-12)


def test_same_generator_gives_the_same_bytes_and_the_argument_stays_as_it_is() -> None:
    before = poses(10)
    kept = before.copy()
    first, again, other = (moved(before, seed, 20.0, 0.012) for seed in (5, 5, 6))
    assert first.tobytes() == again.tobytes() != other.tobytes()
    assert before.tobytes() == kept.tobytes()


def test_no_grasps_give_no_grasps() -> None:
    assert moved(np.empty((0, 4, 4)), 0, 20.0, 0.012).shape == (0, 4, 4)
