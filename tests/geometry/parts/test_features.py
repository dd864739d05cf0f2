"""Scores of surface points for named places, against shapes whose places are known."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
import trimesh

from handmade import candidates, cup, cylinder, drill, hammer, mug
from manitwin.geometry.parts.features import Feature, feature_scores
from manitwin.geometry.parts.shape import Shape, SurfacePoints, measure_shape, surface_points


def measured(mesh: trimesh.Trimesh, stands: bool | None = None) -> tuple[Shape, SurfacePoints]:
    shape = measure_shape(mesh, mesh.center_mass, "wide", stands, np.random.default_rng(0))
    return shape, surface_points(mesh, *candidates(mesh))


def best(feature: Feature, mesh: trimesh.Trimesh, stands: bool | None = None) -> np.ndarray:
    shape, points = measured(mesh, stands)
    return points.positions_m[int(feature_scores(feature, shape, points).argmax())]


@pytest.mark.parametrize("mesh", [mug(), hammer()])
def test_every_feature_scores_between_none_and_one(mesh: trimesh.Trimesh) -> None:
    shape, points = measured(mesh)
    for feature in get_args(Feature):
        scores = feature_scores(feature, shape, points)
        assert scores is None or (scores.shape == (42,) and scores.min() >= 0 and scores.max() <= 1), feature


def test_a_cups_places_are_where_they_are() -> None:
    mesh = cup()
    assert best("rim", mesh)[2] == pytest.approx(0.1, abs=0.003)
    assert best("base", mesh)[2] == pytest.approx(0.0, abs=0.002)
    inside = best("inside", mesh)
    assert np.hypot(*inside[:2]) < 0.0375 and inside[2] < 0.05
    side = best("side", mesh)
    assert np.hypot(*side[:2]) == pytest.approx(0.04, abs=0.001)
    assert side[2] == pytest.approx(mesh.center_mass[2], abs=0.02)


def test_what_a_shape_does_not_have_has_no_score() -> None:
    shape, points = measured(cylinder(0.04, 0.05))
    assert shape.opening is None
    for feature in ("rim", "opening", "handle", "neck"):
        assert feature_scores(feature, shape, points) is None


def test_a_mug_is_poured_opposite_its_handle() -> None:
    assert best("handle", mug())[0] > 0.055
    assert best("spout", mug())[0] < -0.02


def test_a_bottles_neck_is_its_narrow_part() -> None:
    bottle = trimesh.boolean.union([cylinder(0.035, 0.15), cylinder(0.013, 0.05, 0.15), cylinder(0.017, 0.015, 0.2)])
    assert 0.15 <= best("neck", bottle, stands=True)[2] <= 0.205
    assert best("top", bottle, stands=True)[2] > 0.205


def test_a_lying_thing_is_held_along_its_axis_and_a_standing_one_at_its_side() -> None:
    assert best("handle", hammer(), stands=False)[0] > 0.1
    assert measured(mug(), stands=True)[0].side_handle is not None
    assert measured(mug(), stands=False)[0].side_handle is None


def test_the_front_of_a_slab_is_its_large_upper_face() -> None:
    slab = trimesh.creation.box([0.2, 0.14, 0.02])
    front, back = best("front", slab, stands=False), best("back", slab, stands=False)
    assert front[2] == pytest.approx(0.01) and back[2] == pytest.approx(-0.01)
    assert abs(front[0]) < 0.05 and abs(front[1]) < 0.05


def test_a_working_end_is_away_from_the_grip() -> None:
    mesh = drill()
    assert best("muzzle", mesh, stands=False)[0] > 0.12
    grip, housing = best("grip", mesh, stands=False), best("housing", mesh, stands=False)
    assert grip[1] < -0.04 and housing[1] > -0.035 and housing[0] < 0.05


@pytest.mark.parametrize("side", [1, -1])
def test_bristles_are_on_the_side_that_stands_out(side: int) -> None:
    head = trimesh.creation.box([0.06, 0.05, 0.012]).apply_translation([-0.1, 0, 0])
    handle = trimesh.creation.box([0.15, 0.02, 0.012])
    tufts = trimesh.creation.box([0.05, 0.04, 0.025]).apply_translation([-0.1, 0, side * 0.016])
    brush = trimesh.boolean.union([head, handle, tufts])
    place = best("bristles", brush, stands=False)
    assert place[0] < -0.07 and side * place[2] > 0.008


def test_a_hammer_strikes_with_the_blunt_end_of_its_head() -> None:
    shaft = trimesh.creation.box([0.3, 0.02, 0.02])
    blunt = trimesh.creation.box([0.03, 0.06, 0.03]).apply_translation([-0.14, 0.03, 0])
    claw = trimesh.creation.box([0.03, 0.065, 0.006]).apply_translation([-0.14, -0.03, 0])
    assert best("face", trimesh.boolean.union([shaft, blunt, claw]), stands=False)[1] > 0.03


def claw_hammer(shaft_m: float, face_m: float, claw_m: float, bend_m: float) -> trimesh.Trimesh:
    """A hammer along X whose face looks at -Y, and whose claw tapers to +Y and bends back to the handle."""
    parts = [
        trimesh.creation.box([shaft_m, 0.026, 0.024]).apply_translation([shaft_m / 2, 0, 0]),
        trimesh.creation.box([0.03, face_m, 0.024]).apply_translation([0, -face_m / 2, 0]),
    ]
    for share in np.linspace(0, 1, 9):
        piece = trimesh.creation.box([0.03 * (1 - share) + 0.006, claw_m / 5, 0.024])
        parts.append(piece.apply_translation([bend_m * share**2, claw_m * share, 0]))
    return trimesh.boolean.union(parts)


@pytest.mark.parametrize(
    ("shaft_m", "face_m", "claw_m", "bend_m"),
    [(0.2, 0.08, 0.11, 0.04), (0.2, 0.06, 0.11, 0.04), (0.26, 0.06, 0.08, 0.04), (0.26, 0.09, 0.08, 0.0)],
)
def test_a_long_claw_is_no_striking_face(shaft_m: float, face_m: float, claw_m: float, bend_m: float) -> None:
    assert best("face", claw_hammer(shaft_m, face_m, claw_m, bend_m), stands=False)[1] < -0.8 * face_m


def test_an_axe_meets_the_work_with_its_edge() -> None:
    shaft = trimesh.creation.box([0.35, 0.02, 0.02])
    poll = trimesh.creation.box([0.03, 0.025, 0.024]).apply_translation([-0.16, -0.0125, 0])
    edge = [[x, 0.09, 0] for x in (-0.185, -0.1)]
    root = [[x, 0.0, z] for x in (-0.175, -0.145) for z in (-0.012, 0.012)]
    blade = trimesh.convex.convex_hull(np.array(edge + root))
    assert best("face", trimesh.boolean.union([shaft, poll, blade]), stands=False)[1] > 0.06


def test_a_mouth_is_the_rim_or_where_a_lid_closes_it() -> None:
    assert best("mouth", cup())[2] == pytest.approx(0.1, abs=0.003)
    assert best("mouth", cylinder(0.04, 0.05))[2] == pytest.approx(0.05, abs=0.003)


def test_a_flat_end_across_the_boxs_corners_is_thin() -> None:
    flat = trimesh.creation.box([0.02, 0.042, 0.002]).apply_transform(
        trimesh.transformations.rotation_matrix(np.pi / 4, [1, 0, 0])
    )
    body = trimesh.creation.box([0.12, 0.03, 0.03]).apply_translation([0.065, 0, 0])
    tube = trimesh.boolean.union([flat, body])
    shape = measure_shape(tube, tube.center_mass, "thin", False, np.random.default_rng(0))
    assert shape.axis.direction[0] > 0.9, "the thin end comes first"
    assert shape.axis.thickness_m[0] < 0.01


@pytest.mark.parametrize("turn", [np.eye(3), np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])])
def test_an_arch_has_its_apex_and_its_ends_whichever_way_it_lies(turn: np.ndarray) -> None:
    cups = [cylinder(0.035, 0.04).apply_translation([side * 0.08, 0, 0]) for side in (-1, 1)]
    posts = [trimesh.creation.box([0.008, 0.02, 0.17]).apply_translation([side * 0.08, 0, 0.105]) for side in (-1, 1)]
    band = trimesh.creation.box([0.168, 0.02, 0.008]).apply_translation([0, 0, 0.188])
    mesh = trimesh.boolean.union([*cups, *posts, band])
    lying = mesh.copy().apply_transform(np.block([[turn, np.zeros((3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]]))
    apex, end = best("apex", lying, stands=False) @ turn, best("arch_end", lying, stands=False) @ turn
    assert apex[2] > 0.17 and abs(apex[0]) < 0.085
    assert end[2] < 0.05 and abs(end[0]) > 0.07
    assert measured(trimesh.creation.box([0.1, 0.05, 0.2]))[0].arch is None


def shoe(heel_forward: bool, filled: bool = False) -> trimesh.Trimesh:
    """A low front and a high back with the hole for the foot in it, 28 cm long along Y."""
    sole = trimesh.creation.box([0.09, 0.28, 0.045])
    sole.apply_translation([0, 0, 0.0225])
    upper = trimesh.creation.box([0.09, 0.13, 0.07])
    upper.apply_translation([0, 0.075, 0.08])
    mesh = trimesh.boolean.union([sole, upper], engine="manifold")
    if not filled:
        hole = trimesh.creation.box([0.07, 0.11, 0.09])
        hole.apply_translation([0, 0.075, 0.09])
        mesh = trimesh.boolean.difference([mesh, hole], engine="manifold")
    if heel_forward:
        mesh.apply_transform(np.diag([1, -1, 1, 1]))
        mesh.fix_normals()
    return mesh


@pytest.mark.parametrize("heel_forward", [True, False])
@pytest.mark.parametrize("filled", [True, False])
def test_a_toe_is_at_the_end_away_from_where_the_foot_goes_in(heel_forward: bool, filled: bool) -> None:
    toe = best("toe", shoe(heel_forward, filled), stands=True)
    front = 1 if heel_forward else -1
    assert front * toe[1] > 0.09 and toe[2] < 0.05
