"""A filled vessel against the closed forms of a cylinder and a box."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.geometry.mass_properties import shell_mass_properties, solid_mass_properties
from manitwin.geometry.vessel_filling import Vessel

WALL_KG, WALL_M, CONTENTS_KG = 0.05, 0.0005, 0.4
RADIUS_M, HEIGHT_M = 0.03, 0.2


def standing_cylinder() -> trimesh.Trimesh:
    mesh = trimesh.creation.cylinder(RADIUS_M, HEIGHT_M, sections=128)
    mesh.apply_translation([0.01, -0.02, HEIGHT_M / 2])
    return mesh


def test_empty_it_is_the_wall_alone() -> None:
    mesh = standing_cylinder()
    wall = shell_mass_properties(mesh, WALL_KG, WALL_M)
    empty = Vessel(mesh, WALL_M).filled(WALL_KG, 0.0, 0.0)
    assert np.allclose(empty.center_of_mass_m, wall.center_of_mass_m)
    assert np.allclose(empty.inertia_kg_m2, wall.inertia_kg_m2)


@pytest.mark.parametrize("share", [0.25, 0.5, 1.0])
def test_contents_fill_a_cylinder_from_below(share: float) -> None:
    mesh = standing_cylinder()
    found = Vessel(mesh, WALL_M).filled(WALL_KG, CONTENTS_KG * share, share)
    wall, water_kg, level_m = shell_mass_properties(mesh, WALL_KG, WALL_M), CONTENTS_KG * share, HEIGHT_M * share
    total = WALL_KG + water_kg
    height = (WALL_KG * wall.center_of_mass_m[2] + water_kg * level_m / 2) / total
    assert found.center_of_mass_m == pytest.approx([0.01, -0.02, height], abs=2e-4)
    assert Vessel(mesh, WALL_M).center_m(WALL_KG, water_kg, share) == pytest.approx(found.center_of_mass_m, abs=1e-12)
    along = wall.inertia_kg_m2[2, 2] + water_kg * RADIUS_M**2 / 2
    across = wall.inertia_kg_m2[0, 0] + WALL_KG * (wall.center_of_mass_m[2] - height) ** 2
    across += water_kg * (RADIUS_M**2 / 4 + level_m**2 / 12 + (level_m / 2 - height) ** 2)
    assert found.inertia_kg_m2[2, 2] == pytest.approx(along, rel=0.01)
    assert found.inertia_kg_m2[0, 0] == pytest.approx(across, rel=0.01)
    assert np.linalg.eigvalsh(found.inertia_kg_m2).min() > 0


def test_a_heavy_content_is_the_solid() -> None:
    mesh = trimesh.creation.box([0.05, 0.08, 0.12])
    full = Vessel(mesh, WALL_M).filled(1e-9, 1.0, 1.0)
    solid = solid_mass_properties(mesh, 1.0)
    assert np.allclose(full.center_of_mass_m, solid.center_of_mass_m, atol=1e-5)
    assert np.allclose(full.inertia_kg_m2, solid.inertia_kg_m2, rtol=0.01, atol=1e-8)
