"""Which end works and which is held."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import hammer, screwdriver
from manitwin.geometry.boxes import oriented_bounding_box
from manitwin.geometry.parts.shape import HeadEnd, LongAxis, long_axis
from manitwin.geometry.sampling import sample_surface

ANYWAY = trimesh.transformations.rotation_matrix(0.7, [0.3, -0.5, 0.8], [0.1, 0, 0])


def axis_of(mesh: trimesh.Trimesh, head_end: HeadEnd) -> LongAxis:
    points, _, _ = sample_surface(mesh, 4000, np.random.default_rng(0))
    extents, obb_to_object = oriented_bounding_box(mesh.vertices)
    return long_axis(points, extents, obb_to_object, mesh.center_mass, head_end)


@pytest.mark.parametrize("pose", [np.eye(4), ANYWAY])
def test_a_hammers_wide_end_is_its_head_in_any_pose(pose: np.ndarray) -> None:
    mesh = hammer().apply_transform(pose)
    axis = axis_of(mesh, "wide")
    ends = trimesh.transform_points([[-0.015, 0, 0.015], [0.3, 0, 0.015]], pose)
    assert axis.along(ends) == pytest.approx([0, 1], abs=0.01)
    assert axis.length_m == pytest.approx(0.315, abs=1e-6)
    assert axis.head_share == pytest.approx(0.03 / 0.315, abs=0.04)


def test_a_screwdrivers_narrow_end_is_its_head() -> None:
    axis = axis_of(screwdriver(), "narrow")
    assert axis.along(np.array([[0, 0, 0.015], [0.2, 0, 0.015]])) == pytest.approx([0, 1], abs=0.01)
    assert axis.head_share == pytest.approx(0.5, abs=0.04)
    # two boxes: the shaft's 0.1 m of 6 x 6 mm and the handle's of 30 x 30
    shaft, grip = 0.1 * 0.006**2, 0.1 * 0.03**2
    assert axis.center_of_mass_share * 0.2 == pytest.approx((0.05 * shaft + 0.15 * grip) / (shaft + grip), abs=1e-6)


@pytest.mark.parametrize(("rule", "head_x"), [("wide", 0.2), ("thick", 0.2), ("thin", 0.0), ("heavy", 0.2)])
def test_the_rule_decides_which_end_comes_first(rule: HeadEnd, head_x: float) -> None:
    axis = axis_of(screwdriver(), rule)
    assert axis.along(np.array([[head_x, 0, 0.015]]))[0] == pytest.approx(0, abs=0.01)


def test_the_upper_end_comes_first_where_the_rule_says_up() -> None:
    axis = axis_of(trimesh.creation.box([0.02, 0.03, 0.2]), "up")
    assert axis.direction == pytest.approx([0, 0, -1], abs=1e-9)


def test_an_even_rod_gets_the_usual_head() -> None:
    axis = axis_of(trimesh.creation.box([0.2, 0.02, 0.02]), "narrow")
    assert axis.head_share == 0.25 and axis.ratio == pytest.approx(10)
