"""Symmetries of solids of known form."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import cylinder, mug
from manitwin.geometry.symmetry import Symmetries, find_symmetries


def of(mesh: trimesh.Trimesh) -> Symmetries:
    return find_symmetries(mesh, np.random.default_rng(0))


def test_cylinder_is_a_body_of_revolution_wherever_it_stands() -> None:
    mesh = cylinder(0.03, 0.12)
    mesh.apply_translation([0.2, -0.1, 0.0])
    found = of(mesh)
    assert found.axis is not None and abs(found.axis[2]) == pytest.approx(1, abs=1e-6)
    first, across = np.array([0.23, -0.1, 0.04]), np.array([0.2, -0.07, 0.04])
    assert found.apart_m(first, across) == pytest.approx(0, abs=1e-4)
    assert found.apart_m(first, across + np.array([0, 0, 0.03])) == pytest.approx(
        0.01, abs=1e-3
    )  # upside down: 0.05 for 0.07
    assert found.apart_m(first, np.array([0.2, -0.1, 0.0])) > 0.03


def test_box_has_its_mirrors_and_half_turns_and_no_axis() -> None:
    found = of(trimesh.creation.box([0.2, 0.12, 0.05]))
    assert found.axis is None and len(found.motions) == 2**3
    assert found.apart_m(np.array([0.1, 0.02, 0.01]), np.array([-0.1, -0.02, -0.01])) == pytest.approx(0, abs=1e-3)
    assert found.apart_m(np.array([0.1, 0, 0]), np.array([0, 0.06, 0])) > 0.05


def test_symmetries_are_about_the_centroid_of_the_surface() -> None:
    mesh = trimesh.creation.revolve([(0, 0), (0.03, 0), (0.08, 0.06), (0, 0.06)], sections=64)
    mesh.apply_translation([0.2, -0.1, 0.0])
    assert of(mesh).center_m[:2] == pytest.approx([0.2, -0.1], abs=1e-9)


def test_mug_has_the_mirror_through_its_handle_only() -> None:
    found = of(mug())
    assert found.axis is None and len(found.motions) == 2
    assert found.apart_m(np.array([0, 0.04, 0.05]), np.array([0, -0.04, 0.05])) == pytest.approx(0, abs=2e-3)
    assert found.apart_m(np.array([0.075, 0, 0.05]), np.array([-0.04, 0, 0.05])) > 0.05


@pytest.mark.parametrize(("sides", "turns"), [(3, 6), (5, 10), (6, 12)])
def test_prism_has_all_turns_of_its_sides_and_flips(sides: int, turns: int) -> None:
    found = of(trimesh.creation.cylinder(0.025, 0.14, sections=sides))
    assert found.axis is None and (np.linalg.det(found.motions) > 0).sum() == turns


def test_cube_has_24_turns_of_which_two_make_a_third() -> None:
    found = of(trimesh.creation.box([0.06, 0.06, 0.06]))
    turns = found.motions[np.linalg.det(found.motions) > 0]
    assert len(turns) == 24 and len(found.motions) == 48
    made = np.einsum("aij,bjk->abik", turns, turns).reshape(-1, 1, 3, 3)
    assert np.abs(made - turns).max((2, 3)).min(1).max() < 1e-9


def test_ball_is_the_same_after_any_turn_and_a_cylinder_is_not() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.035)
    ball.apply_translation([0.1, 0.0, 0.0])
    found = of(ball)
    assert found.ball and not of(cylinder(0.03, 0.12)).ball
    oblique = np.array([0.1, 0.0, 0.0]) + 0.035 * np.array([0.48, 0.6, 0.64])
    assert found.apart_m(np.array([0.135, 0.0, 0.0]), oblique) == pytest.approx(0, abs=1e-3)


def gear(teeth: int) -> trimesh.Trimesh:
    """A gear about Z, of which two turns by one tooth are two teeth."""
    angles = np.arange(4 * teeth) * 2 * np.pi / (4 * teeth)
    radii = np.where(np.arange(4 * teeth) % 4 < 2, 0.03, 0.024)
    outline = np.stack([radii * np.cos(angles), radii * np.sin(angles)], 1)
    middle, n = np.zeros((1, 2)), len(outline)
    flat = np.concatenate([middle, outline])
    vertices = np.concatenate([np.c_[flat, np.full(n + 1, z)] for z in (-0.006, 0.006)])
    i, j = 1 + np.arange(n), 1 + (np.arange(n) + 1) % n
    top, zero = n + 1, np.zeros(n, int)
    faces = [(zero, j, i), (zero + top, i + top, j + top), (i, j, j + top), (i, j + top, i + top)]
    return trimesh.Trimesh(vertices, np.concatenate([np.stack(each, 1) for each in faces]), process=False)


@pytest.mark.parametrize("teeth", [9, 16, 20])
def test_gear_has_the_turns_of_all_of_its_teeth(teeth: int) -> None:
    found = of(gear(teeth))
    assert found.axis is None and (np.linalg.det(found.motions) > 0).sum() == 2 * teeth
    angles = np.arccos(np.clip((np.trace(found.motions, axis1=1, axis2=2) - 1) / 2, -1, 1))
    assert np.isclose(angles, 2 * np.pi / teeth).sum() == 2  # there and back


def test_motions_are_a_group_where_a_small_part_is_near_its_tolerance() -> None:
    for radius_m in np.linspace(0.003, 0.008, 11):
        stem = trimesh.creation.cylinder(radius_m, 0.02, sections=24)
        stem.apply_translation([0.006, 0, 0.044])
        motions = of(trimesh.util.concatenate([trimesh.creation.icosphere(3, 0.036), stem])).motions
        made = np.einsum("aij,bjk->abik", motions, motions).reshape(-1, 1, 3, 3)
        assert np.abs(made - motions).max((2, 3)).min(1).max() < 1e-2
