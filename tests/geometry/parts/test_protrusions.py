"""Handles and spouts of upright bodies, against shapes whose parts are known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import cup, cylinder, mug
from manitwin.geometry.parts.protrusions import round_body
from manitwin.geometry.sampling import sample_surface


def samples(mesh: trimesh.Trimesh, turn_deg: float = 0.0, shift_m: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    points, _, _ = sample_surface(mesh, 6000, np.random.default_rng(0))
    turn = trimesh.transformations.rotation_matrix(np.radians(turn_deg), [0, 0, 1])
    return trimesh.transform_points(points, turn) + np.array([*shift_m, 0.0])


@pytest.mark.parametrize("turn_deg", [0.0, 90.0, 179.0, -120.0])
def test_a_mugs_handle_is_found_where_it_is(turn_deg: float) -> None:
    body = round_body(samples(mug(), turn_deg, (0.02, -0.01)))
    assert len(body.protrusions) == 1
    handle = body.protrusions[0]
    assert np.cos(handle.azimuth_rad - np.radians(turn_deg)) > np.cos(np.radians(6))
    assert body.axis_xy_m == pytest.approx([0.02, -0.01], abs=0.003)
    assert body.radius_m.max() == pytest.approx(0.04, abs=0.004)
    # from 1.12 radii and 3 % of it out to 75 mm
    assert handle.reach_m == pytest.approx(0.075 - 1.15 * 0.04, abs=0.004)


def test_the_handles_points_belong_to_it_and_the_bodys_do_not() -> None:
    body = round_body(samples(mug()))
    points = np.array([[0.072, 0, 0.05], [-0.04, 0, 0.05], [0.028, 0.028, 0.05], [0.0, 0.0, 0.0]])
    assert body.protrusion_mask(points, body.protrusions[0]).tolist() == [True, False, False, False]


@pytest.mark.parametrize("mesh", [cup(), cylinder(0.03, 0.2), trimesh.creation.icosphere(radius=0.05)])
def test_a_round_body_has_no_handle(mesh: trimesh.Trimesh) -> None:
    assert round_body(samples(mesh)).protrusions == ()


def test_a_handle_and_a_spout_are_two_the_handle_first() -> None:
    spout = trimesh.creation.box([0.02, 0.012, 0.012])
    spout.apply_translation([-0.045, 0, 0.08])
    found = round_body(samples(trimesh.boolean.union([mug(), spout], engine="manifold"))).protrusions
    assert len(found) == 2
    assert np.cos(found[0].azimuth_rad) > 0.99 and np.cos(found[1].azimuth_rad) < -0.99


def test_a_box_is_no_body_with_four_handles() -> None:
    box = trimesh.creation.box([0.1, 0.1, 0.1])
    body = round_body(samples(box))
    assert all(p.reach_m < 0.35 * 0.05 for p in body.protrusions)
