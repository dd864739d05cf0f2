from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.geometry.boxes import (
    extents_along_sides,
    footprint,
    oriented_bounding_box,
    separation_m,
    smallest_enclosing_circle,
    turn_to_sides,
    upright_extents,
)
from manitwin.geometry.poses import inverse, transform_points


def test_box_of_a_turned_box_is_the_box() -> None:
    for seed in range(5):
        turn = trimesh.transformations.random_rotation_matrix(rand=np.random.default_rng(seed).random(3))
        turn[:3, 3] = [0.1, -0.3, 0.2]
        points = transform_points(turn, trimesh.creation.box((0.05, 0.11, 0.23)).vertices)
        extents_m, obb_to_object = oriented_bounding_box(points)
        assert np.sort(extents_m) == pytest.approx([0.05, 0.11, 0.23])
        assert obb_to_object[:3, 3] == pytest.approx([0.1, -0.3, 0.2])
        assert np.linalg.det(obb_to_object[:3, :3]) == pytest.approx(1.0)
        local = transform_points(inverse(obb_to_object), points)
        assert np.abs(local).max(0) == pytest.approx(extents_m / 2)


def test_box_keeps_the_names_of_the_axes_it_is_aligned_with() -> None:
    extents_m, obb_to_object = oriented_bounding_box(trimesh.creation.box((0.3, 0.1, 0.2)).vertices)
    assert extents_m == pytest.approx([0.3, 0.1, 0.2])
    assert obb_to_object == pytest.approx(np.eye(4), abs=1e-9)


def test_box_is_never_larger_than_the_axis_aligned_one() -> None:
    points = np.random.default_rng(3).normal(size=(200, 3)) * [1, 2, 3]
    assert np.prod(oriented_bounding_box(points)[0]) <= np.prod(np.ptp(points, axis=0)) + 1e-12


def test_length_is_that_of_what_stands_whatever_its_turn_about_z() -> None:
    box = trimesh.creation.box((0.23, 0.05, 0.11)).vertices
    for angle in (0.0, 0.4, 1.3, 3.0):
        turn = trimesh.transformations.rotation_matrix(angle, [0, 0, 1])
        assert upright_extents(transform_points(turn, box)) == pytest.approx([0.23, 0.05, 0.11])


def test_length_is_no_diagonal_where_the_smallest_box_leans() -> None:
    # A thin sheet along the diagonal of a square of 0.2 m, upright: its smallest box lies along it, 0.2 * sqrt(2) m long.
    sheet = trimesh.creation.box((0.2 * np.sqrt(2), 0.01, 0.01))
    sheet.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 4, [0, 1, 0]))
    leaning = 0.2 + 0.01 / np.sqrt(2)
    assert oriented_bounding_box(sheet.vertices)[0].max() == pytest.approx(0.2 * np.sqrt(2))
    assert upright_extents(sheet.vertices) == pytest.approx([leaning, 0.01, leaning])


@pytest.mark.parametrize(("lies_deg", "turn_deg"), [(0, 0), (30, 30), (-40, -40), (60, -30), (170, -10)])
def test_a_rectangle_is_turned_to_its_nearer_axis(lies_deg: float, turn_deg: float) -> None:
    angle = np.radians(lies_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    cosine, sine = turn_to_sides(np.array([[3.0, 1], [3, -1], [-3, 1], [-3, -1]]) @ turn.T)
    assert np.degrees(np.arctan2(sine, cosine)) == pytest.approx(turn_deg, abs=1e-4)


def test_circle_of_a_rectangle_has_half_its_diagonal() -> None:
    center, radius = smallest_enclosing_circle(np.array([[0, 0], [0.3, 0], [0.3, 0.4], [0, 0.4], [0.1, 0.1]]))
    assert center == pytest.approx([0.15, 0.2])
    assert radius == pytest.approx(0.25)


def test_circle_of_an_acute_triangle_is_its_circumcircle_and_of_an_obtuse_one_its_longest_side() -> None:
    corners = np.array([[0, 0], [1, 0], [0.5, np.sqrt(3) / 2]])
    assert smallest_enclosing_circle(corners)[1] == pytest.approx(1 / np.sqrt(3))
    assert smallest_enclosing_circle(np.array([[0, 0], [1, 0], [0.4, 0.1]]))[1] == pytest.approx(0.5)


def test_circle_is_the_minimum_found_by_search() -> None:
    from scipy.optimize import minimize

    points = np.random.default_rng(4).normal(size=(60, 2))
    _, radius = smallest_enclosing_circle(points)

    def largest(center: np.ndarray) -> float:
        return float(np.linalg.norm(points - center, axis=1).max())

    searched = minimize(largest, points.mean(0), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12})
    assert radius == pytest.approx(searched.fun, abs=1e-6)


def test_circle_of_points_on_a_line_and_of_one_point() -> None:
    center, radius = smallest_enclosing_circle(np.array([[0, 0], [1, 1], [3, 3.0]]))
    assert center == pytest.approx([1.5, 1.5]) and radius == pytest.approx(1.5 * np.sqrt(2))
    assert smallest_enclosing_circle(np.array([[2.0, 5.0]]))[1] == 0


def square(x: float, y: float, turn: float = 0.0) -> np.ndarray:
    corners = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (0, 1)])
    cos, sin = np.cos(turn), np.sin(turn)
    return footprint(corners @ np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]).T + [x, y, 0])


def test_a_box_covers_its_four_corners() -> None:
    assert sorted(map(tuple, square(0, 0).tolist())) == [(-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)]


def test_the_separation_of_squares() -> None:
    assert separation_m(square(0, 0), square(1.25, 0.3)) == pytest.approx(0.25)
    assert separation_m(square(0, 0), square(0.8, 0)) == pytest.approx(-0.2)
    # turned by 45 degrees, a corner points at the edge
    assert separation_m(square(0, 0), square(2, 0, np.pi / 4)) == pytest.approx(1.5 - np.sqrt(0.5))


def test_the_bound_is_never_above_the_distance() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        one, other = square(0, 0, rng.uniform(0, 3)), square(*rng.uniform(-3, 3, 2), rng.uniform(0, 3))
        dense = [
            (a + (b - a) * t)
            for polygon in (one, other)
            for a, b in zip(polygon, np.roll(polygon, -1, 0), strict=True)
            for t in np.linspace(0, 1, 40)
        ]
        half = len(dense) // 2
        distance = min(np.linalg.norm(np.array(dense[half:]) - p, axis=1).min() for p in dense[:half])
        assert separation_m(one, other) <= distance + 0.05


def test_a_mug_is_as_long_as_with_its_handle_and_a_bar_that_lies_askew_as_along_itself() -> None:
    angle = np.linspace(0, 2 * np.pi, 200)
    around = np.column_stack([0.041 * np.cos(angle), 0.041 * np.sin(angle)])
    handle = np.array([[0.073, -0.008], [0.073, 0.008]])
    mug = np.vstack([np.column_stack([np.vstack([around, handle]), np.full(202, z)]) for z in (0, 0.095)])
    assert upright_extents(mug)[0] < 0.11
    assert extents_along_sides(mug) == pytest.approx([0.114, 0.082, 0.095], abs=1e-4)
    bar = np.array([[x, y, z] for x in (-0.15, 0.15) for y in (-0.05, 0.05) for z in (0, 0.05)])
    turn = np.array([[np.cos(0.2), -np.sin(0.2)], [np.sin(0.2), np.cos(0.2)]])
    assert extents_along_sides(np.column_stack([bar[:, :2] @ turn.T, bar[:, 2]])) == pytest.approx([0.3, 0.1, 0.05])


@pytest.mark.parametrize("turn_rad", [0.0, 0.5, 1.0, np.pi / 4])
def test_an_aircraft_is_as_long_as_from_nose_to_tail_and_a_square_as_its_side(turn_rad: float) -> None:
    """A smaller rectangle stands askew around the cross of hull and wings, and a larger one along a square's diagonals."""
    turn = np.array([[np.cos(turn_rad), -np.sin(turn_rad)], [np.sin(turn_rad), np.cos(turn_rad)]])
    outline = [[-0.07, -0.02], [-0.07, 0.02], [0.02, 0.07], [0.11, 0.01], [0.11, -0.01], [0.02, -0.07]]
    aircraft = np.array([[*(turn @ corner), z] for corner in outline for z in (0.0, 0.05)])
    assert upright_extents(aircraft)[0] < 0.17
    assert extents_along_sides(aircraft) == pytest.approx([0.18, 0.14, 0.05])
    square = np.array([[*(turn @ [x, y]), z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (0.0, 0.05)])
    assert extents_along_sides(square) == pytest.approx([0.2, 0.2, 0.05])


def test_a_sheet_on_edge_is_measured_as_long_as_it_is() -> None:
    """Seen from above it is a line, which has no area."""
    sheet = np.array([[x, 0.5 * x, z] for x in (0.0, 0.2) for z in (0.0, 0.1)])
    assert extents_along_sides(sheet)[0] == pytest.approx(0.2 * np.hypot(1, 0.5))
