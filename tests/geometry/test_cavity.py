import numpy as np
import pytest
import trimesh

from manitwin.geometry.cavity import cavity_volume, find_opening
from real_meshes import VESSELS, cup, load_real_mesh

INSIDE_M3 = np.pi * 0.037**2 * 0.097  # of the cup of radius 40, height 100, wall 3 mm


def test_cavity_of_a_cup_is_its_inside() -> None:
    assert cavity_volume(cup(), np.array([0, 0, 1.0])) == pytest.approx(INSIDE_M3, rel=0.02)
    assert cavity_volume(cup(), np.array([0, 0, -1.0])) == pytest.approx(0, abs=1e-9)


def test_opening_of_a_cup_is_its_rim() -> None:
    opening = find_opening(cup())
    assert opening is not None
    assert opening.axis == pytest.approx([0, 0, 1])
    assert opening.volume_m3 == pytest.approx(INSIDE_M3, rel=0.03)
    assert opening.depth_m == pytest.approx(0.097, abs=1e-4)
    assert opening.rim_radius_m == pytest.approx(0.037, abs=1e-3)
    assert opening.center_m == pytest.approx([0, 0, 0.1], abs=2e-3)


def test_opening_is_found_wherever_it_points() -> None:
    turn = trimesh.transformations.rotation_matrix(np.radians(40), [1, 2, 0])
    lying = cup().apply_transform(turn)
    opening = find_opening(lying)
    assert opening is not None
    assert opening.axis @ turn[:3, 2] > np.cos(np.radians(11))
    upside_down = find_opening(cup().apply_transform(np.diag([1, -1, -1, 1])))
    assert upside_down is not None and upside_down.axis == pytest.approx([0, 0, -1])


def open_box(wall_m: float, drain_m: float = 0.0) -> trimesh.Trimesh:
    """A box of 200 mm by 140 mm by 80 mm, open above, with a square hole of a side of ``drain_m`` in its floor."""
    box = trimesh.creation.box((0.2, 0.14, 0.08))
    hollow = trimesh.creation.box((0.2 - 2 * wall_m, 0.14 - 2 * wall_m, 0.08))
    solid = box.difference(hollow.apply_translation((0, 0, wall_m)))
    return solid.difference(trimesh.creation.box((drain_m, drain_m, 0.1))) if drain_m else solid


@pytest.mark.parametrize("wall_m", [0.0004, 0.0008, 0.002])
def test_walls_thinner_than_a_cell_hold(wall_m: float) -> None:
    opening = find_opening(open_box(wall_m))
    assert opening is not None and opening.axis == pytest.approx([0, 0, 1])
    assert opening.depth_m == pytest.approx(0.08 - wall_m, abs=1e-4)
    assert opening.volume_m3 == pytest.approx(0.2 * 0.14 * 0.08, rel=0.12), "cells on the wall are not counted"


def test_a_drain_is_closed_but_no_large_hole() -> None:
    drained, bottomless = find_opening(open_box(0.003, 0.02)), find_opening(open_box(0.003, 0.08))
    assert drained is not None and drained.depth_m == pytest.approx(0.077, abs=1e-4)
    assert bottomless is None


def test_solids_and_rings_have_no_opening() -> None:
    assert find_opening(trimesh.creation.box((0.1, 0.1, 0.1))) is None
    assert find_opening(trimesh.creation.torus(0.05, 0.01)) is None
    assert find_opening(trimesh.creation.annulus(0.03, 0.04, 0.1)) is None


@pytest.mark.shared_data
@pytest.mark.parametrize("name", [*VESSELS, "plate_8in"])
def test_real_vessels_open_upward(shared_data, name: str) -> None:
    opening = find_opening(load_real_mesh(shared_data, name))
    assert opening is not None and opening.axis == pytest.approx([0, 0, 1])


@pytest.mark.shared_data
@pytest.mark.parametrize("name", ["banana", "large_clamp", "tomato_soup_can", "fork", "headset"])
def test_real_things_that_hold_nothing_have_no_opening(shared_data, name: str) -> None:
    assert find_opening(load_real_mesh(shared_data, name)) is None
