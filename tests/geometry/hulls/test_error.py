import numpy as np
import pytest
import trimesh

from manitwin.geometry.cavity import find_opening
from manitwin.geometry.hulls.error import hull_error, hull_union, inside_any_hull
from real_meshes import cup


def _box(low: tuple[float, float, float], high: tuple[float, float, float]) -> np.ndarray:
    return np.array(trimesh.creation.box(bounds=[low, high]).vertices)


def test_union_of_two_overlapping_boxes_has_their_joint_volume() -> None:
    union = hull_union([_box((0, 0, 0), (0.1, 0.1, 0.1)), _box((0.05, 0, 0), (0.2, 0.1, 0.1))])
    assert union.is_watertight
    assert union.volume == pytest.approx(0.002)


def test_equal_shapes_have_no_error_wherever_they_are_cut() -> None:
    mesh = trimesh.creation.box(bounds=[(0, 0, 0), (0.2, 0.1, 0.1)])
    halves = [_box((0, 0, 0), (0.08, 0.1, 0.1)), _box((0.08, 0, 0), (0.2, 0.1, 0.1))]
    error = hull_error(mesh, halves, None, np.random.default_rng(0))
    assert error.surface_error_max_m < 1e-9 and error.surface_uncovered_max_m < 1e-9
    assert error.volume_ratio == pytest.approx(1.0)
    assert error.cavity_kept is None


def test_hull_that_is_too_small_is_uncovered_by_its_gap() -> None:
    mesh = trimesh.creation.box((0.1, 0.1, 0.1))
    error = hull_error(mesh, [_box((-0.05, -0.05, -0.05), (0.05, 0.05, 0.04))], None, np.random.default_rng(0))
    assert error.surface_uncovered_max_m == pytest.approx(0.01)
    assert error.volume_ratio == pytest.approx(0.9)


def test_hull_that_is_too_large_errs_outside_but_covers() -> None:
    mesh = trimesh.creation.box((0.1, 0.1, 0.1))
    error = hull_error(mesh, [_box((-0.05, -0.05, -0.05), (0.05, 0.05, 0.06))], None, np.random.default_rng(0))
    assert error.surface_uncovered_max_m == 0
    assert error.surface_error_max_m == pytest.approx(0.01, abs=1e-9)


def test_lid_on_a_cup_keeps_nothing_of_its_cavity() -> None:
    mesh = cup()
    error = hull_error(mesh, [np.asarray(mesh.convex_hull.vertices)], find_opening(mesh), np.random.default_rng(0))
    assert error.cavity_kept == pytest.approx(0, abs=1e-6)


def test_points_inside_any_hull() -> None:
    hulls = [_box((0, 0, 0), (1, 1, 1)), _box((2, 0, 0), (3, 1, 1))]
    points = np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [2.5, 0.5, 0.5]])
    assert inside_any_hull(points, hulls).tolist() == [True, False, True]
