"""Barrel, grip and working end of pistol-shaped things made by hand, wherever they point."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import cup, drill
from manitwin.geometry.parts.pistol import Pistol, find_pistol
from manitwin.geometry.parts.shape import measure_shape

CHUCK_M, BACK_M, GRIP_M = np.array([0.15, 0, 0]), np.array([-0.08, 0, 0]), np.array([-0.02, -0.09, 0])


def pistol_of(mesh: trimesh.Trimesh) -> Pistol | None:
    return measure_shape(mesh, mesh.center_mass, "wide", False, np.random.default_rng(0)).pistol


TURNS = [
    ([0, 0, 1], 0.0),
    ([0, 0, 1], 0.7),
    ([0, 0, 1], 2.5),
    ([1, 0, 0], np.pi),
    ([0, 1, 0], np.pi),
    ([1, 1, 0.3], 1.9),
]


@pytest.mark.parametrize(("axis", "angle_rad"), TURNS)
@pytest.mark.parametrize("foot", [True, False])
def test_a_drill_works_at_its_chuck_wherever_it_points(axis: list[float], angle_rad: float, foot: bool) -> None:
    turn = trimesh.transformations.rotation_matrix(angle_rad, axis)
    pistol = pistol_of(drill(foot=foot).apply_transform(turn))
    assert pistol is not None
    along, down = pistol.places(np.stack([CHUCK_M, BACK_M, GRIP_M]) @ turn[:3, :3].T)
    assert along[0] == pytest.approx(0, abs=0.05) and along[1] == pytest.approx(1, abs=0.05)
    assert 0 < down[0] < 1 and 0 < down[1] < 1, "on the barrel"
    assert down[2] > 1 and along[2] == pytest.approx(pistol.grip_share, abs=0.1)


def test_the_end_that_tapers_works_where_the_grip_is_in_the_middle() -> None:
    pistol = pistol_of(drill(grip_x_m=0.035, foot=False))
    assert pistol is not None and pistol.places(CHUCK_M[None])[0][0] == pytest.approx(0, abs=0.05)


@pytest.mark.parametrize(
    "mesh", [cup(), trimesh.creation.box([0.2, 0.05, 0.04]), trimesh.creation.icosphere(radius=0.05)]
)
def test_what_has_no_grip_across_is_no_pistol(mesh: trimesh.Trimesh) -> None:
    assert pistol_of(mesh) is None


def test_a_block_is_no_pistol() -> None:
    extents_m = np.array([0.2, 0.1, 0.05])
    surface_m = np.random.default_rng(0).uniform(-0.5, 0.5, (2000, 3)) * extents_m
    assert find_pistol(surface_m, extents_m, np.eye(4)) is None
