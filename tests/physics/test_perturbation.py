"""Perturbations: their ranges and distributions, and what each of them does to grasp, body and settings."""

from __future__ import annotations

from dataclasses import astuple, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from manitwin.physics.robustness import Perturbation, PerturbationRanges, draw_perturbations
from rigid_boxes import PANDA, SETTINGS, above, box

SPREAD = PerturbationRanges(
    pose_m=0.005, pose_deg=5.0, friction=(0.6, 1.4), force=(0.5, 1.0), mass_kg=(0.1, 0.4), center_of_mass_m=0.02
)
MANY = 1024


def flat(draw: Perturbation) -> np.ndarray:
    return np.concatenate([np.ravel(value) for value in astuple(draw)])


@pytest.fixture(scope="module")
def draws() -> list[Perturbation]:
    return draw_perturbations(SPREAD, MANY, seed=4)


@pytest.mark.parametrize(
    ("attribute", "radius"),
    [("shift_m", 0.005), ("turn_rad", np.radians(5.0)), ("center_of_mass_shift_m", 0.02)],
)
def test_shifts_and_turns_are_uniform_in_their_balls(draws: list[Perturbation], attribute: str, radius: float) -> None:
    vectors = np.array([getattr(draw, attribute) for draw in draws])
    length = np.linalg.norm(vectors, axis=1)
    assert length.max() <= radius * (1 + 1e-9)
    assert kstest((length / radius) ** 3, "uniform").statistic < 0.03  # 1.63 / sqrt(1024) = 0.05 is the 1 % limit
    for along in (vectors / length[:, None]).T:  # each coordinate of a point on a sphere is uniform (Archimedes)
        assert kstest(along, "uniform", args=(-1, 2)).statistic < 0.03


def test_factors_are_uniform_and_masses_uniform_in_their_logarithm(draws: list[Perturbation]) -> None:
    friction, force, mass_kg = (np.array([getattr(d, n) for d in draws]) for n in ("friction", "force", "mass_kg"))
    assert kstest(friction, "uniform", args=(0.6, 0.8)).statistic < 0.03
    assert kstest(force, "uniform", args=(0.5, 0.5)).statistic < 0.03
    assert kstest(np.log(mass_kg), "uniform", args=(np.log(0.1), np.log(4))).statistic < 0.03
    assert np.median(mass_kg) == pytest.approx(0.2, rel=0.02)


def test_quantities_vary_independently_of_each_other(draws: list[Perturbation]) -> None:
    correlation = np.corrcoef(np.array([flat(draw) for draw in draws]).T)
    assert np.abs(correlation - np.eye(len(correlation))).max() < 0.13  # 4 / sqrt(1024)


def test_same_seed_gives_the_same_draws_and_the_first_of_more_are_the_same() -> None:
    ten = draw_perturbations(SPREAD, 10, seed=1)
    for count in (1, 2, 3, 9, 10, 17, 40):
        more = draw_perturbations(SPREAD, count, seed=1)
        assert len(more) == count
        for first, second in zip(ten, more, strict=False):
            assert flat(first).tobytes() == flat(second).tobytes()
    assert not np.allclose(flat(ten[0]), flat(draw_perturbations(SPREAD, 1, seed=2)[0]))


def test_known_mass_and_no_spread_change_nothing() -> None:
    still = PerturbationRanges(0.0, 0.0, (1.0, 1.0), (1.0, 1.0), (0.3, 0.3), 0.0)
    body, pose = box([0.04, 0.05, 0.06], 0.3), above([0.01, 0.02, 0.03])
    for draw in draw_perturbations(still, 3, seed=0):
        assert draw.grasp(pose, PANDA.tip_depth_m) == pytest.approx(pose, abs=1e-12)
        assert draw.settings(SETTINGS) == SETTINGS
        other = draw.body(body)
        assert other.mass_kg == pytest.approx(0.3)
        assert other.inertia_kg_m2 == pytest.approx(body.inertia_kg_m2)
        assert other.center_of_mass_m == pytest.approx(body.center_of_mass_m)


def test_a_draw_changes_pose_about_the_fingertips_body_and_settings() -> None:
    draw = Perturbation(
        shift_m=np.array([0.001, 0.002, -0.003]),
        turn_rad=np.array([0.0, 0.0, np.pi / 2]),
        friction=0.5,
        force=0.6,
        mass_kg=0.6,
        center_of_mass_shift_m=np.array([0.0, 0.01, 0.0]),
    )
    depth_m = PANDA.tip_depth_m
    pose = above([0.01, 0.02, 0.03])
    after = draw.grasp(pose, depth_m)
    tip = after[:3, 3] + depth_m * after[:3, 2]
    # from above, the gripper's Y and Z are the object's -Y and -Z
    assert tip == pytest.approx([0.011, 0.018, 0.033])
    assert after[:3, 0] == pytest.approx(pose[:3, 1]), "a quarter turn about the approach takes X to Y"
    body = replace(box([0.04, 0.05, 0.06], 0.3, friction=0.4), friction_dynamic=0.3)
    other = draw.body(body)
    assert (other.mass_kg, other.friction_static, other.friction_dynamic) == pytest.approx((0.6, 0.2, 0.15))
    assert other.inertia_kg_m2 == pytest.approx(2 * body.inertia_kg_m2)
    assert other.center_of_mass_m == pytest.approx([0, 0.01, 0])
    assert other.hulls is body.hulls
    settings = draw.settings(SETTINGS)
    assert (settings.force_n, settings.finger_friction) == pytest.approx((30.0, 0.5))
    assert replace(settings, force_n=50.0, finger_friction=1.0) == SETTINGS


def test_turns_are_as_large_as_said(draws: list[Perturbation]) -> None:
    pose = above([0, 0, 0])
    turned = [draw.grasp(pose, PANDA.tip_depth_m)[:3, :3] @ pose[:3, :3].T for draw in draws[:64]]
    angles = [Rotation.from_matrix(turn).magnitude() for turn in turned]
    assert angles == pytest.approx([np.linalg.norm(draw.turn_rad) for draw in draws[:64]], abs=1e-9)
