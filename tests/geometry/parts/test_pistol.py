"""Barrel, grip and working end of pistol-shaped things made by hand, wherever they point."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import cup, cylinder, drill
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


def leaning_drill(
    lean_rad: float, grip_m: float = 0.19, foot_m: float = 0.1, side_handle: bool = False
) -> trimesh.Trimesh:
    """A short barrel along X that tapers to its chuck at +X, and a long grip that leans, as drills have it."""
    forward = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0])
    lean = trimesh.transformations.rotation_matrix(lean_rad, [0, 0, 1])
    lower = [
        trimesh.creation.box([0.045, grip_m, 0.04]).apply_translation([0, -grip_m / 2, 0]),
        trimesh.creation.box([foot_m, 0.06, 0.055]).apply_translation([foot_m / 2 - 0.03, -grip_m, 0]),
    ]
    parts = [
        cylinder(0.028, 0.12).apply_transform(forward).apply_translation([-0.07, 0, 0]),
        trimesh.creation.cone(0.028, 0.09).apply_transform(forward).apply_translation([0.05, 0, 0]),
        *(part.apply_transform(lean).apply_translation([-0.025, 0, 0]) for part in lower),
    ]
    if side_handle:
        parts.append(cylinder(0.018, 0.16).apply_translation([0.03, -0.01, 0]))
    return trimesh.boolean.union(parts)


@pytest.mark.parametrize(
    ("lean_rad", "grip_m", "foot_m", "side_handle"),
    [
        (0.35, 0.19, 0.07, False),
        (-0.15, 0.15, 0.07, False),
        (-0.15, 0.19, 0.07, False),
        (0.2, 0.19, 0.1, False),
        (0.2, 0.15, 0.1, True),
        (0.0, 0.15, 0.1, True),
    ],
)
def test_a_grip_as_long_as_the_barrel_is_no_barrel(
    lean_rad: float, grip_m: float, foot_m: float, side_handle: bool
) -> None:
    pistol = pistol_of(leaning_drill(lean_rad, grip_m, foot_m, side_handle))
    lean = trimesh.transformations.rotation_matrix(lean_rad, [0, 0, 1])
    held = lean[:3, :3] @ [0, -0.08, 0] + [-0.025, 0, 0]
    assert pistol is not None
    along, down = pistol.places(np.array([[0.138, 0, 0], [-0.07, 0, 0], held]))
    assert along[0] == pytest.approx(0, abs=0.1) and along[1] == pytest.approx(1, abs=0.1)
    assert 0 < down[0] < 1 and 0 < down[1] < 1, "on the barrel"
    assert down[2] > 1 and along[2] == pytest.approx(pistol.grip_share, abs=0.15)


def test_a_lever_beside_the_handle_makes_no_second_barrel() -> None:
    """A caulking gun: a frame, and a handle and a lever that spread below its rear."""
    parts = [trimesh.creation.box([0.24, 0.035, 0.03])]
    for angle_rad, length_m in ((-0.1, 0.13), (0.6, 0.11)):
        bar = trimesh.creation.box([0.02, length_m, 0.02]).apply_translation([0, -length_m / 2, 0])
        turn = trimesh.transformations.rotation_matrix(angle_rad, [0, 0, 1])
        parts.append(bar.apply_transform(turn).apply_translation([-0.08, 0, 0]))
    pistol = pistol_of(trimesh.boolean.union(parts))
    assert pistol is not None
    along, down = pistol.places(np.array([[0.12, 0, 0], [-0.12, 0, 0]]))
    assert along == pytest.approx([0, 1], abs=0.05) and np.all((down > 0) & (down < 1))


@pytest.mark.parametrize(
    "mesh", [cup(), trimesh.creation.box([0.2, 0.05, 0.04]), trimesh.creation.icosphere(radius=0.05)]
)
def test_what_has_no_grip_across_is_no_pistol(mesh: trimesh.Trimesh) -> None:
    assert pistol_of(mesh) is None


def test_a_block_is_no_pistol() -> None:
    extents_m = np.array([0.2, 0.1, 0.05])
    surface_m = np.random.default_rng(0).uniform(-0.5, 0.5, (2000, 3)) * extents_m
    assert find_pistol(surface_m, np.eye(4)) is None
