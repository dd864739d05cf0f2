"""Candidates lie where functions are: in the middle of a vessel's floor, though nothing there stands out."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.geometry.candidate_sampling import MOST_RESTING, sample_candidates
from manitwin.geometry.cavity import find_opening
from manitwin.geometry.sampling import sample_surface

COUNT = 42


def _dish(radius_m: float, depth_m: float, wall_m: float) -> trimesh.Trimesh:
    """Return a dish whose floor rises into its wall without an edge: a parabola inside and outside."""
    across = np.linspace(0.0, 1.0, 40)
    outer = np.column_stack([radius_m * across, depth_m * across**4])
    inner = np.column_stack([(radius_m - wall_m) * across, wall_m + (depth_m - wall_m) * across**4])
    return trimesh.creation.revolve(np.vstack([outer, inner[::-1]]), sections=64)


def _candidates(mesh: trimesh.Trimesh, *, told: bool = True, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    points, normals, _ = sample_surface(mesh, 8000, np.random.default_rng(seed))
    chosen = sample_candidates(points, normals, COUNT, find_opening(mesh) if told else None)
    return points[chosen], normals[chosen]


def _nearest_m(points: np.ndarray, normals: np.ndarray, looking: float) -> float:
    """Return how far the nearest candidate that looks up (1) or down (-1) is from the middle."""
    return float(np.linalg.norm(points[looking * normals[:, 2] > 0.9, :2], axis=1).min(initial=np.inf))


def test_middle_of_a_floor_that_runs_into_its_wall_is_a_candidate() -> None:
    dish = _dish(0.1, 0.035, 0.003)
    assert _nearest_m(*_candidates(dish), 1.0) < 0.005
    assert _nearest_m(*_candidates(dish), -1.0) < 0.005, "through 3 mm of wall: the middle of the underside"
    assert _nearest_m(*_candidates(dish, told=False), 1.0) > 0.01, "shows nothing: it is found without"


def test_floor_and_underside_are_one_place_each_and_the_rest_stays_spread() -> None:
    points, normals = _candidates(_dish(0.1, 0.035, 0.003))
    assert len(points) == COUNT
    apart = np.linalg.norm(points[:, None] - points, axis=2) + np.eye(COUNT) + (normals @ normals.T < -0.5)
    assert apart.min() > 0.004
    underside = (points[:, 2] < 0.002) & (normals[:, 2] < -0.8)
    assert underside.mean() <= MOST_RESTING


def test_what_has_no_floor_gets_no_candidate_for_it() -> None:
    ring = trimesh.creation.annulus(r_min=0.03, r_max=0.05, height=0.02)
    points, normals, _ = sample_surface(ring, 4000, np.random.default_rng(0))
    assert find_opening(ring) is None
    same = sample_candidates(points, normals, COUNT)
    assert np.array_equal(sample_candidates(points, normals, COUNT, find_opening(ring)), same)
