"""Maps on surfaces of which the answer is known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.dataset.affordances.heat_maps import (
    area_under_curve,
    contact_density,
    contact_points,
    function_map,
    similarity,
    split_half_agreement,
    surface_distances,
)
from manitwin.geometry.poses import transform
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import sample_surface

BOX = trimesh.creation.box([0.04, 0.06, 0.1])


def test_contacts_are_where_the_fingers_meet_the_surface() -> None:
    down = np.diag([1.0, -1.0, -1.0])  # approaches from above, closes along x
    poses = np.array([transform(down, np.array([0.0, y, 0.15])) for y in (0.0, 0.01)])
    contacts, grasps = contact_points(RayCaster(BOX), poses, np.array([0.04, 0.04]), np.array([0.12, 0.13]))
    assert grasps.tolist() == [0, 1, 0, 1]
    assert contacts == pytest.approx(
        np.array([[0.02, 0, 0.03], [0.02, 0.01, 0.02], [-0.02, 0, 0.03], [-0.02, 0.01, 0.02]])
    )


@pytest.mark.parametrize(("width_m", "kept"), [(0.05, 2), (0.036, 2), (0.07, 0), (0.01, 0)])
def test_a_contact_off_the_surface_is_left_out(width_m: float, kept: int) -> None:
    pose = transform(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 0.15]))[None]
    contacts, _ = contact_points(RayCaster(BOX), pose, np.array([width_m]), np.array([0.12]))
    assert len(contacts) == kept
    assert np.abs(np.abs(contacts[:, 0]) - 0.02).max(initial=0) < 1e-6


def test_density_is_largest_where_contacts_are() -> None:
    points = np.array([[0.0, 0, 0], [0.01, 0, 0], [0.1, 0, 0]])
    density = contact_density(points, np.array([[0.0, 0, 0], [0.001, 0, 0]]), 0.01)
    assert density[0] == 1 and 0.5 < density[1] < 0.7 and density[2] < 1e-9
    assert not contact_density(points, np.empty((0, 3)), 0.01).any()


def test_distances_go_along_the_surface_and_through_no_wall() -> None:
    plate = trimesh.creation.box([0.2, 0.2, 0.002])
    points, normals, _ = sample_surface(plate, 3000, np.random.default_rng(0))

    def nearest(place: list[float]) -> int:
        on_its_side = normals[:, 2] * np.sign(place[2]) > 0.9
        return int(np.argmin(np.where(on_its_side, np.linalg.norm(points - place, axis=1), np.inf)))

    top, under, beside = nearest([0, 0, 0.001]), nearest([0, 0, -0.001]), nearest([0.05, 0, 0.001])
    (distance_m,) = surface_distances(points, normals, np.array([top]))
    assert distance_m[beside] == pytest.approx(0.05, rel=0.15)
    assert distance_m[under] > 0.15, "round the edge, or not at all"
    assert function_map(distance_m, plate.extents)[top] == 1
    assert function_map(np.array([np.inf, 0.0]), plate.extents).tolist() == [0, 1]


def test_similarity_and_area_are_those_of_their_definitions() -> None:
    one, other = np.array([1.0, 1, 0, 0]), np.array([0.0, 0, 1, 1])
    assert (similarity(one, one), similarity(one, other), similarity(one, 0 * one)) == (1, 0, 0)
    rng = np.random.default_rng(1)
    scores, positive = rng.integers(0, 5, 60).astype(float), rng.random(60) < 0.4
    pairs = [(s > t) + 0.5 * (s == t) for s in scores[positive] for t in scores[~positive]]
    assert area_under_curve(scores, positive) == pytest.approx(np.mean(pairs))
    assert np.isnan(area_under_curve(scores, np.ones(60, bool)))


def test_halves_agree_by_the_points_that_the_other_half_calls_its_own() -> None:
    line = np.stack([np.linspace(0, 1, 101), np.zeros(101), np.zeros(101)], axis=1)
    near, far = np.tile([0.2, 0, 0], (8, 1)), np.tile([0.8, 0, 0], (8, 1))
    same = split_half_agreement(line, near, near, 0.05)
    assert same == (pytest.approx(1), pytest.approx(1))
    apart = split_half_agreement(line, near, far, 0.05)
    assert apart[0] < 0.01 and apart[1] < 0.3
    # half of the first map's contacts lie at the second's place: it is found among the higher half of the points
    both = split_half_agreement(line, np.concatenate([near, far]), far, 0.05)
    assert both[0] == pytest.approx(0.5, abs=0.02) and both[1] == pytest.approx(1 - 0.5 * 11 / 90, abs=0.02)
